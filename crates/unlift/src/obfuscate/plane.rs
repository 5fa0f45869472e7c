//! Scheme `plane`: keeps one coordinate of every point, on one of three servers.

use super::scheme::{Entry, Lift, Lifted};
use crate::Error;
use crate::released::{AxisPlanes, Obfuscation};
use crate::seed::{Key, Stage};

/// Registry entry.
pub const ENTRY: Entry = Entry {
    title: "Axis-aligned planes",
    rule: "Each point keeps one coordinate of three.",
    color: 5,
    source: "Geppert et al., Privacy Preserving Partial Localization, CVPR 2022",
    hidden: "two of three coordinates",
    patents: "none found",
    ..Entry::new("plane", Lift::In3d(|points, key, _| lift(points.positions, key)))
};

/// Partial localization: random thirds, one per axis. The attacker has all three.
fn lift(points: &[[f64; 3]], key: &Key) -> Result<Lifted<3>, Error> {
    let mut axis: Vec<u8> = (0..points.len()).map(|i| (i % 3) as u8).collect();
    key.draws(Stage::Scheme, 0).shuffle(&mut axis);
    let offset: Vec<f64> =
        points.iter().zip(&axis).map(|(point, &a)| point[usize::from(a)]).collect();
    Ok(Lifted::one_each(Obfuscation::AxisPlanes(AxisPlanes::try_new(axis, &offset)?)))
}
