//! Scheme `sphere`: the bearing of every point from the center of the map, among decoys.
//!
//! The center is the mean of all points. A share of the points keeps its bearing. The other records
//! are decoys: the bearing of a withheld point with Gaussian noise on each component, brought to
//! length 1, and the descriptor of that point, so that the number of records stays. In the secret, a
//! decoy stands for the point that it withholds; its ray does not pass through it.
//!
//! The published code confirms the center and the share. It reads maps with
//! decoys and does not make them: the variance of the noise and the source of a decoy's descriptor
//! are assumptions.

use super::ray::rays_from;
use super::scheme::{Entry, Facts, Lift, Lifted, LocalPoints, SchemeOptions};
use crate::released::{Obfuscation, Rays};
use crate::seed::{Key, Stage};
use crate::{Error, OriginalId};

/// Share of the points that keep their bearing.
const KEPT: f64 = 1.0 / 3.0;
/// Variance of the noise of a decoy, per component of its unit direction.
const VARIANCE: f64 = 0.1;

/// Registry entry.
pub const ENTRY: Entry = Entry {
    parameters: |_| vec![("share of real bearings", KEPT)],
    ..Entry::new(
        "sphere",
        Facts {
            title: "Sphere cloud, a third of the bearings real",
            rule: "Each point becomes its bearing from the center of the map, among decoys.",
            color: 7,
            source: "Moon et al., Depth-Guided Privacy-Preserving Visual Localization Using 3D Sphere Clouds, BMVC 2024",
            hidden: "the range from the center (1 of 3 coordinates)",
            patents: "PCT application declared by its authors",
        },
        Lift::In3d(lift),
    )
};

/// Sphere clouds.
fn lift(points: &LocalPoints<'_, 3>, key: &Key, _: &SchemeOptions) -> Result<Lifted<3>, Error> {
    let points = points.positions;
    let n = points.len();
    if n < 2 {
        return Err(Error::new("points", "at least 2", n.to_string()));
    }
    let center: [f64; 3] =
        std::array::from_fn(|c| points.iter().map(|p| p[c]).sum::<f64>() / n as f64);
    let mut lifted = rays_from(&[center], points, |_, _| 0)?;
    let Obfuscation::Rays(rays) = &lifted.obfuscation else { return Ok(lifted) };
    let order = key.draws(Stage::Scheme, 0).permutation(n);
    let mut is_decoy = vec![true; n];
    let n_kept = (KEPT * n as f64).round() as usize;
    order[..n_kept].iter().for_each(|&row| is_decoy[row as usize] = false);
    let noise = key.stage(Stage::Scheme);
    let moved = |(direction, &OriginalId(row)): (&[f32; 3], &OriginalId)| {
        let direction = direction.map(f64::from);
        if !is_decoy[row as usize] {
            return direction;
        }
        let mut draws = noise.draws(1 + u64::from(row));
        direction.map(|x| x + VARIANCE.sqrt() * draws.normal())
    };
    let directions: Vec<[f64; 3]> =
        rays.direction().iter().zip(&lifted.hidden).map(moved).collect();
    let centers: Vec<[f64; 3]> = rays.centers().iter().map(|c| c.map(f64::from)).collect();
    let rays = Rays::try_new(&centers, rays.center().to_vec(), &directions)?;
    lifted.obfuscation = Obfuscation::Rays(rays);
    Ok(lifted)
}
