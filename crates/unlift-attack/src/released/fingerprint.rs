//! The hash that identifies a released map.

use sha2::{Digest, Sha256};

use super::obfuscation::Obfuscation;
use crate::descriptors::Values;
use crate::geometry::frame::Bounds;
use crate::{Descriptors, Fingerprint, Unit};

/// Returns the first 16 bytes of the SHA-256 of all map data, in normal form and relative to its origin. It covers only what an attacker
/// has, so it may be in every file made from the map.
pub(super) fn of<const D: usize>(
    obfuscation: &Obfuscation<D>,
    slots_per_record: usize,
    (origin, unit, bounds): ([f64; D], Unit, Option<Bounds<D>>),
    descriptors: Option<&Descriptors>,
) -> Fingerprint {
    let mut hasher = Sha256::new();
    hasher.update(format!(
        "unlift released 1, {D}D, {} {} of {}, {}\n",
        obfuscation.len(),
        obfuscation.family(),
        slots_per_record,
        unit.name()
    ));
    f64s(&mut hasher, &origin);
    match obfuscation {
        Obfuscation::Lines(lines) => {
            f32s(&mut hasher, lines.foot().as_flattened());
            f32s(&mut hasher, lines.direction().as_flattened());
        }
        Obfuscation::Rays(rays) => {
            hasher.update([rays.centers().len() as u8]);
            f32s(&mut hasher, rays.centers().as_flattened());
            hasher.update(rays.center());
            f32s(&mut hasher, rays.direction().as_flattened());
            rays.regions().into_iter().flatten().for_each(|region| corners(&mut hasher, region));
        }
        Obfuscation::AxisPlanes(planes) => {
            hasher.update(planes.axis());
            f32s(&mut hasher, planes.offset());
        }
        Obfuscation::AxisCandidates(candidates) => {
            f32s(&mut hasher, candidates.position().as_flattened());
        }
    }
    if let Some(bounds) = bounds {
        hasher.update("bounds");
        corners(&mut hasher, &bounds);
    }
    // A file of a map without records has no descriptors.
    if let Some(descriptors) = descriptors.filter(|_| !obfuscation.is_empty()) {
        hasher.update(format!("descriptors of {}", descriptors.dim()));
        match descriptors.values() {
            Values::U8(values) => hasher.update(values),
            Values::F32(values) => f32s(&mut hasher, values),
        }
    }
    let hash = hasher.finalize();
    Fingerprint(std::array::from_fn(|at| hash[at]))
}

fn corners<const D: usize>(hasher: &mut Sha256, bounds: &Bounds<D>) {
    f64s(hasher, &bounds.low);
    f64s(hasher, &bounds.high);
}

fn f32s(hasher: &mut Sha256, values: &[f32]) {
    // In pieces, because descriptors of a large map take hundreds of megabytes.
    for piece in values.chunks(1 << 10) {
        let bytes: Vec<u8> = piece.iter().flat_map(|x| x.to_le_bytes()).collect();
        hasher.update(&bytes);
    }
}

fn f64s(hasher: &mut Sha256, values: &[f64]) {
    values.iter().for_each(|x| hasher.update(x.to_le_bytes()));
}
