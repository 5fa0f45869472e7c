//! Decoys among bearings: records whose neighbors by descriptors do not lie in nearby directions.

use super::Neighborhoods;
use crate::geometry::vector::{dot, widen};
use crate::released::Released;

/// Bearings within this angle support each other: the noise of decoys is three times as large.
const NEARBY: f64 = 0.1;
/// Support from which on a record counts as real, as a multiple of that by chance.
pub const REAL: f64 = 1.5;
/// Rounds in which records with more support count more.
const ROUNDS: usize = 4;

/// Returns the support of every record by its lists, as a multiple of that by chance; `None` unless records are bearings from one center.
pub fn support<const D: usize>(released: &Released<D>, lists: &Neighborhoods) -> Option<Vec<f64>> {
    let rays = released.obfuscation().rays()?;
    let n = rays.center().len();
    if rays.centers().len() > 1 || lists.n_slots() != n || n < 2 {
        return None;
    }
    let directions = rays.direction();
    let near = |a: usize, b: usize| {
        let cosine = dot(&widen(&directions[a]), &widen(&directions[b]));
        f64::from(u8::from(cosine > libm::cos(NEARBY)))
    };
    // Records of a list, and records that list this one.
    let mut listed: Vec<Vec<u32>> = vec![Vec::new(); n];
    for slot in 0..n {
        for record in lists.of(slot) {
            listed[slot].push(record.0);
            listed[record.index()].push(slot as u32);
        }
    }
    // Support by chance: what another record's list gives.
    let mut weights = vec![1.0; n];
    let mut found = vec![0.0; n];
    for _ in 0..ROUNDS {
        let of = |own: usize, by: usize| {
            let others = || listed[by].iter().map(|&other| other as usize);
            let total: f64 = others().map(|other| weights[other]).sum();
            let agree = others().map(|other| weights[other] * near(own, other));
            agree.sum::<f64>() / total.max(1e-12)
        };
        let chance = (0..n).map(|own| of(own, (own + n / 2) % n)).sum::<f64>() / n as f64;
        found = (0..n).map(|own| of(own, own) / chance.max(1.0 / n as f64)).collect();
        weights = found.iter().map(|support| 0.1 + support.min(10.0)).collect();
    }
    Some(found)
}
