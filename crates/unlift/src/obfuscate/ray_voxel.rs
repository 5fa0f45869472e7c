//! Scheme `ray-voxel`: ray clouds whose centers are chosen by a 3D checkerboard.

use std::sync::Arc;

use super::ray::from_centers;
use super::scheme::{Entry, Facts, Lifted, Scheme};
use crate::Error;
use crate::geometry::frame::Bounds;
use crate::released::Obfuscation;
use crate::seed::Key;

/// Ray clouds, voxel variant.
#[derive(Clone, Copy, Debug)]
pub struct RayVoxel {
    /// Edge of a voxel, in the unit of the points.
    pub voxel: f64,
}

/// Registry entry.
pub const ENTRY: Entry = Entry {
    name: "ray-voxel",
    facts: Facts {
        summary: "as ray, the center given by the parity of the point's voxel",
        source: "Moon et al., Efficient Privacy-Preserving Visual Localization Using 3D Ray Clouds, CVPR 2024",
        hidden: "the range from the center (1 of 3 coordinates)",
        patents: "as ray",
    },
    in_2d: None,
    in_3d: Some(|options| Arc::new(RayVoxel { voxel: options.voxel })),
};

impl Scheme<3> for RayVoxel {
    fn name(&self) -> &str {
        ENTRY.name
    }

    fn parameters(&self) -> Vec<(&'static str, f64)> {
        vec![("voxel", self.voxel)]
    }

    fn lift(
        &self,
        points: &[[f64; 3]],
        _: Option<&Bounds<3>>,
        key: &Key,
    ) -> Result<Lifted<3>, Error> {
        if !(self.voxel.is_finite() && self.voxel > 0.0) {
            return Err(Error::new("voxel", "a positive length", self.voxel.to_string()));
        }
        // The grid starts half a voxel below the smallest coordinates, as in the authors' code
        // (Open3D).
        let mut low = [f64::INFINITY; 3];
        for point in points {
            low = std::array::from_fn(|c| low[c].min(point[c]));
        }
        let start = low.map(|x| x - 0.5 * self.voxel);
        from_centers(points, key, |_, point| {
            let cell = |c: usize| ((point[c] - start[c]) / self.voxel).floor();
            (0..3).map(|c| cell(c).rem_euclid(2.0) as usize).sum::<usize>() % 2
        })
    }
}
