//! Schemes of half-lines from one of two centers, which is chosen at random for every point (`ray`) or by a checkerboard of voxels
//! (`ray-voxel`).

use std::sync::Arc;

use super::kmeans::kmeans;
use super::scheme::{Entry, Facts, Lifted, LocalPoints, Scheme};
use crate::geometry::vector::{dot, sub};
use crate::released::{Obfuscation, Rays};
use crate::seed::{Key, Stage};
use crate::truth::{DropReason, Dropped};
use crate::{Error, OriginalId};

/// Ray clouds.
#[derive(Clone, Copy, Debug)]
pub struct Ray;

/// Registry entry.
pub const ENTRY: Entry = Entry {
    name: "ray",
    facts: Facts {
        title: "Ray cloud, two centers",
        rule: "Each point becomes a ray from one of two published centers.",
        color: 3,
        source: "Moon et al., Efficient Privacy-Preserving Visual Localization Using 3D Ray Clouds, CVPR 2024",
        hidden: "the range from the center (1 of 3 coordinates)",
        patents: "US 2025/0329045 A1; PCT application declared by its authors",
    },
    in_2d: None,
    in_3d: Some(|_| Arc::new(Ray)),
};

/// Restarts of k-means (scikit-learn's `n_init` in the authors' code).
const RESTARTS: u64 = 10;

impl Scheme<3> for Ray {
    fn name(&self) -> &str {
        ENTRY.name
    }

    fn lift(&self, points: &LocalPoints<'_, 3>, key: &Key) -> Result<Lifted<3>, Error> {
        let choices = key.stage(Stage::Scheme);
        from_centers(points.positions, key, |row, _| choices.draws(row as u64).below(2) as usize)
    }
}

/// Ray clouds, voxel variant.
#[derive(Clone, Copy, Debug)]
pub struct RayVoxel {
    /// Edge of a voxel, in the unit of the points.
    pub voxel: f64,
}

/// Registry entry of `ray-voxel`.
pub const VOXEL: Entry = Entry {
    name: "ray-voxel",
    facts: Facts {
        title: "Ray cloud, voxel parity",
        rule: "Each point becomes a ray from one of two published centers; the voxel of the point decides which.",
        color: 4,
        patents: "as ray",
        ..ENTRY.facts
    },
    in_2d: None,
    in_3d: Some(|options| Arc::new(RayVoxel { voxel: options.voxel })),
};

impl Scheme<3> for RayVoxel {
    fn name(&self) -> &str {
        VOXEL.name
    }

    fn parameters(&self) -> Vec<(&'static str, f64)> {
        vec![("voxel", self.voxel)]
    }

    fn lift(&self, points: &LocalPoints<'_, 3>, key: &Key) -> Result<Lifted<3>, Error> {
        if !(self.voxel.is_finite() && self.voxel > 0.0) {
            return Err(Error::new("voxel", "a positive length", self.voxel.to_string()));
        }
        // The grid starts half a voxel below the smallest coordinates, as in the authors' code
        // (Open3D).
        let mut low = [f64::INFINITY; 3];
        for point in points.positions {
            low = std::array::from_fn(|c| low[c].min(point[c]));
        }
        let start = low.map(|x| x - 0.5 * self.voxel);
        from_centers(points.positions, key, |_, point| {
            let cell = |c: usize| ((point[c] - start[c]) / self.voxel).floor();
            (0..3).map(|c| cell(c).rem_euclid(2.0) as usize).sum::<usize>() % 2
        })
    }
}

/// Returns rays from two k-means centers to every point. `choose` returns the center of a row.
fn from_centers(
    points: &[[f64; 3]],
    key: &Key,
    choose: impl Fn(usize, &[f64; 3]) -> usize,
) -> Result<Lifted<3>, Error> {
    if points.len() < 2 {
        return Err(Error::new("points", "at least 2 for two centers", points.len().to_string()));
    }
    rays_from(&kmeans(points, 2, RESTARTS, key), points, choose)
}

/// Returns rays from `centers` to every point. `choose` returns the center of a row.
pub(super) fn rays_from<const D: usize>(
    centers: &[[f64; D]],
    points: &[[f64; D]],
    choose: impl Fn(usize, &[f64; D]) -> usize,
) -> Result<Lifted<D>, Error> {
    // Rays start at the stored center, which is rounded to `f32`.
    let centers: Vec<[f64; D]> = centers.iter().map(|c| c.map(|x| f64::from(x as f32))).collect();
    let (mut hidden, mut dropped) = (Vec::new(), Vec::new());
    let (mut center, mut direction) = (Vec::new(), Vec::new());
    for (row, point) in points.iter().enumerate() {
        let original = OriginalId::from_index(row);
        let chosen = choose(row, point);
        let along = sub(point, &centers[chosen]);
        let length2 = dot(&along, &along);
        if length2 <= 1e-24 * dot(point, point) {
            dropped.push(Dropped { original, reason: DropReason::OnCenter });
            continue;
        }
        hidden.push(original);
        center.push(chosen as u8);
        let length = length2.sqrt();
        direction.push(along.map(|x| x / length));
    }
    Ok(Lifted {
        obfuscation: Obfuscation::Rays(Rays::try_new(&centers, center, &direction)?),
        slots_per_record: 1,
        hidden,
        swapped_axis: None,
        dropped,
    })
}
