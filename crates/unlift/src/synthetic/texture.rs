//! Textures and outlines of surfaces.

use super::vectors::{add, cross, norm, scale};

/// Relative density of the features that a detector finds on a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Texture {
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
    const fn new([even, outline, patches, per_patch, patch_radius]: [f64; 5]) -> Self {
        Self { even, outline, patches, per_patch, patch_radius }
    }

    pub(super) const PAINT: Self = Self::new([1.5, 2.5, 0.4, 16.0, 0.03]);
    pub(super) const SMOOTH: Self = Self::new([10.0, 18.0, 1.5, 22.0, 0.025]);
    pub(super) const WOOD: Self = Self::new([22.0, 24.0, 7.0, 36.0, 0.03]);
    pub(super) const FLOOR: Self = Self::new([5.0, 3.0, 1.5, 24.0, 0.04]);
    pub(super) const FABRIC: Self = Self::new([45.0, 14.0, 8.0, 50.0, 0.035]);
    pub(super) const PATTERN: Self = Self::new([150.0, 50.0, 26.0, 80.0, 0.035]);
    pub(super) const PRINT: Self = Self::new([2_100.0, 70.0, 150.0, 26.0, 0.016]);
    pub(super) const LEAVES: Self = Self::new([2_000.0, 150.0, 0.0, 0.0, 0.02]);
    pub(super) const GLASS: Self = Self::new([6.0, 60.0, 0.0, 0.0, 0.02]);
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
