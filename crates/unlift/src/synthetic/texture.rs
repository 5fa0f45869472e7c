//! Materials, textures and outlines of surfaces.

use super::vectors::{Turn, add, cross, norm, rotate, scale, sub};

/// Material of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Material {
    /// Painted walls and ceilings.
    Paint,
    /// Lacquer, metal, plastic.
    Smooth,
    /// Grained wood.
    Wood,
    /// Floor boards.
    Boards,
    /// Upholstery.
    Fabric,
    /// Woven or painted patterns.
    Pattern,
    /// Printed things: spines, covers, pictures, packages.
    Print,
    /// Leaves.
    Leaves,
    /// Window panes.
    Glass,
}

/// Flat surface in a room, visible only from the side of `u x v`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheet {
    /// Corner of the parallelogram, `(3,)`, in meters.
    pub corner: [f64; 3],
    /// First side.
    pub u: [f64; 3],
    /// Second side.
    pub v: [f64; 3],
    /// If true, only the ellipse within the parallelogram.
    pub round: bool,
    /// Material.
    pub material: Material,
    /// Number of the piece of furniture. A table and its chairs share one.
    pub piece: u32,
    /// Number of the object, such as a book or a board.
    pub part: u32,
}

/// Relative density of the features that a detector finds on a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Texture {
    pub(super) material: Material,
    /// Points per square meter, everywhere.
    pub(super) even: f64,
    /// Points per meter of outline.
    pub(super) outline: f64,
    /// Patches (stains, prints, knots) per square meter.
    pub(super) patches: f64,
    /// Points per patch.
    pub(super) per_patch: f64,
    /// Standard deviation of a patch, in meters.
    pub(super) patch_radius: f64,
}

impl Texture {
    const fn new(
        material: Material,
        [even, outline, patches, per_patch, patch_radius]: [f64; 5],
    ) -> Self {
        Self { material, even, outline, patches, per_patch, patch_radius }
    }

    pub(super) const PAINT: Self = Self::new(Material::Paint, [1.5, 2.5, 0.4, 16.0, 0.03]);
    pub(super) const SMOOTH: Self = Self::new(Material::Smooth, [10.0, 18.0, 1.5, 22.0, 0.025]);
    pub(super) const WOOD: Self = Self::new(Material::Wood, [22.0, 24.0, 7.0, 36.0, 0.03]);
    pub(super) const FLOOR: Self = Self::new(Material::Boards, [5.0, 3.0, 1.5, 24.0, 0.04]);
    pub(super) const FABRIC: Self = Self::new(Material::Fabric, [45.0, 14.0, 8.0, 50.0, 0.035]);
    pub(super) const PATTERN: Self = Self::new(Material::Pattern, [150.0, 50.0, 26.0, 80.0, 0.035]);
    pub(super) const PRINT: Self = Self::new(Material::Print, [2_100.0, 70.0, 150.0, 26.0, 0.016]);
    pub(super) const LEAVES: Self = Self::new(Material::Leaves, [2_000.0, 150.0, 0.0, 0.0, 0.02]);
    pub(super) const GLASS: Self = Self::new(Material::Glass, [6.0, 60.0, 0.0, 0.0, 0.02]);
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Outline {
    /// Whole parallelogram.
    Full,
    /// Ellipse that touches the middle of each edge.
    Ellipse,
}

/// Flat surface, visible from the side of its normal `u x v`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    pub(super) corner: [f64; 3],
    pub(super) u: [f64; 3],
    pub(super) v: [f64; 3],
    pub(super) outline: Outline,
    pub(super) texture: Texture,
    pub(super) piece: u32,
    pub(super) part: u32,
}

impl Surface {
    /// Returns the point at `(s, t)`, both 0 to 1.
    pub(super) fn at(&self, s: f64, t: f64) -> [f64; 3] {
        add(self.corner, add(scale(self.u, s), scale(self.v, t)))
    }

    /// Returns true if `(s, t)` lies on the surface.
    pub(super) fn holds(&self, s: f64, t: f64) -> bool {
        let within = (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t);
        match self.outline {
            Outline::Full => within,
            Outline::Ellipse => {
                let (x, y) = (2.0 * s - 1.0, 2.0 * t - 1.0);
                x * x + y * y <= 1.0
            }
        }
    }

    /// Returns the surface in a frame with the origin `middle`, rotated by `turn`.
    pub(super) fn in_frame(&self, middle: [f64; 3], turn: Turn) -> Sheet {
        Sheet {
            corner: rotate(turn, sub(self.corner, middle)),
            u: rotate(turn, self.u),
            v: rotate(turn, self.v),
            round: self.outline == Outline::Ellipse,
            material: self.texture.material,
            piece: self.piece,
            part: self.part,
        }
    }

    pub(super) fn normal(&self) -> [f64; 3] {
        let n = cross(self.u, self.v);
        scale(n, 1.0 / norm(n))
    }

    /// Returns the area in square meters.
    pub(super) fn area(&self) -> f64 {
        let full = norm(cross(self.u, self.v));
        match self.outline {
            Outline::Full => full,
            // pi / 4; three digits are enough for a density.
            Outline::Ellipse => 0.785 * full,
        }
    }
}
