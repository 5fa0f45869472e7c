//! `ray-voxel`: as `ray`, the center decided by a 3D checkerboard.

use super::ray::from_centers;
use super::{Entry, Lifted, Scheme, SchemeOptions};
use crate::Error;
use crate::geometry::frame::Bounds;
use crate::released::Obfuscation;
use crate::seed::Key;

/// Ray clouds, voxel variant.
#[derive(Clone, Copy, Debug)]
pub struct RayVoxel;

/// The registry row.
pub const ENTRY: Entry = Entry {
    name: "ray-voxel",
    summary: "as ray, the center given by the parity of the point's voxel",
    source: "Moon et al., Efficient Privacy-Preserving Visual Localization Using 3D Ray Clouds, CVPR 2024",
    hidden: "the range from the center (1 of 3 coordinates)",
    patents: "as ray",
    in_2d: None,
    in_3d: Some(&RayVoxel),
};

impl Scheme<3> for RayVoxel {
    fn lift(
        &self,
        points: &[[f64; 3]],
        _: Option<&Bounds<3>>,
        options: &SchemeOptions,
        key: &Key,
    ) -> Result<Lifted<3>, Error> {
        // The grid of the authors' code (Open3D): it starts half a voxel below the smallest coordinates.
        let mut low = [f64::INFINITY; 3];
        for point in points {
            low = std::array::from_fn(|c| low[c].min(point[c]));
        }
        let start = low.map(|x| x - 0.5 * options.voxel);
        let mut lifted = from_centers(points, key, |_, point| {
            let cell = |c: usize| ((point[c] - start[c]) / options.voxel).floor();
            (0..3).map(|c| cell(c).rem_euclid(2.0) as usize).sum::<usize>() % 2
        })?;
        if let Obfuscation::Rays(rays) = lifted.obfuscation {
            lifted.obfuscation = Obfuscation::Rays(rays.with_voxel(options.voxel)?);
        }
        Ok(lifted)
    }
}
