//! Mitigations: simple changes to a map before a scheme hides it.
//!
//! With a scheme it is itself a scheme ([`Changed`](super::Changed)): `ppl_thin4_bits2`.

use nalgebra::{DMatrix, SymmetricEigen};

use crate::descriptors::Values;
use crate::seed::{Key, Stage};
use crate::{Descriptors, Error};

/// One change to a map.
#[derive(Clone, Debug, PartialEq)]
enum Step {
    /// Keeps this share of the points: random ones, or those that most images observe.
    Thin { keep: f64, by_tracks: bool },
    /// Adds Gaussian noise of this standard deviation to each value of unit-length descriptors.
    Noise(f64),
    /// Rounds every value to one of `2^n` levels, which are fitted per column.
    Bits(u32),
    /// Keeps this number of principal components, learned on the map.
    Pca(usize),
    /// Sets the descriptors of this share of the points, chosen at random, to zero.
    Drop(f64),
}

/// Changes to a map, applied in order before a scheme hides it.
#[derive(Clone, Debug, PartialEq)]
pub struct Mitigation(Vec<Step>);

const FORMS: &str = "thin:1/N, thin:tracks:1/N, noise:DEVIATION, bits:N, pca:N or drop:SHARE";

impl Mitigation {
    /// Parses steps separated by commas: `thin:1/4,bits:2`. The error names all forms.
    ///
    /// # Errors
    /// If a step has another form, or a number is out of range.
    pub fn parse(text: &str) -> Result<Self, Error> {
        text.split(',').map(step).collect::<Result<_, _>>().map(Self)
    }

    /// Returns true if a step chooses points by the number of images that observe them.
    pub fn needs_tracks(&self) -> bool {
        self.0.iter().any(|step| matches!(step, Step::Thin { by_tracks: true, .. }))
    }

    /// Returns true if a step changes descriptors.
    pub fn changes_descriptors(&self) -> bool {
        self.0.iter().any(|step| !matches!(step, Step::Thin { .. }))
    }

    /// Returns true if every step fits single images: it keeps all points and learns nothing.
    pub fn fits_images(&self) -> bool {
        self.0.iter().all(|step| matches!(step, Step::Noise(_) | Step::Drop(_)))
    }

    /// Returns the name in rows: letters, digits, `_` and `.`.
    pub fn name(&self) -> String {
        let name = |step: &Step| match step {
            Step::Thin { keep, by_tracks: false } => format!("thin{}", 1.0 / keep),
            Step::Thin { keep, by_tracks: true } => format!("tracks{}", 1.0 / keep),
            Step::Noise(deviation) => format!("noise{deviation}"),
            Step::Bits(bits) => format!("bits{bits}"),
            Step::Pca(n) => format!("pca{n}"),
            Step::Drop(share) => format!("drop{share}"),
        };
        self.0.iter().map(name).collect::<Vec<_>>().join("_")
    }

    /// Returns the rows that stay, ascending; `tracks` are numbers of images per point.
    pub(super) fn kept(
        &self,
        n: usize,
        tracks: Option<&[u32]>,
        key: &Key,
    ) -> Result<Vec<u32>, Error> {
        let mut rows: Vec<u32> = (0..n as u32).collect();
        for (at, step) in self.0.iter().enumerate() {
            let Step::Thin { keep, by_tracks } = step else { continue };
            let mut draws = key.of_item(Stage::Mitigation, at as u64).draws(Stage::Mitigation, 0);
            // The order among equally long tracks is random, too.
            draws.shuffle(&mut rows);
            if *by_tracks {
                let Some(tracks) = tracks.filter(|tracks| tracks.len() == n) else {
                    return Err(Error::new("thin:tracks", "a map with tracks", "none"));
                };
                rows.sort_by_key(|&row| std::cmp::Reverse(tracks[row as usize]));
            }
            rows.truncate((keep * rows.len() as f64).round() as usize);
            rows.sort_unstable();
        }
        Ok(rows)
    }

    /// Returns the changed descriptors. Bytes stay bytes; floats get their original length back.
    pub(super) fn descriptors(
        &self,
        descriptors: &Descriptors,
        key: &Key,
    ) -> Result<Descriptors, Error> {
        let (n, dim) = (descriptors.len(), descriptors.dim());
        let mut values: Vec<f64> = descriptors.rows().flatten().map(f64::from).collect();
        let lengths: Vec<f64> = values.chunks(dim).map(length).collect();
        for (row, length) in values.chunks_mut(dim).zip(&lengths) {
            row.iter_mut().for_each(|x| *x /= length.max(1e-12));
        }
        for (at, step) in self.0.iter().enumerate() {
            let key = key.of_item(Stage::Mitigation, at as u64);
            match step {
                Step::Thin { .. } => {}
                Step::Noise(deviation) => {
                    let stage = key.stage(Stage::Mitigation);
                    for (row, values) in values.chunks_mut(dim).enumerate() {
                        let mut draws = stage.draws(row as u64);
                        values.iter_mut().for_each(|x| *x += deviation * draws.normal());
                    }
                }
                Step::Bits(bits) => (0..dim).for_each(|c| quantize(&mut values, dim, c, *bits)),
                Step::Pca(most) => project(&mut values, dim, *most)?,
                Step::Drop(share) => {
                    let order = key.draws(Stage::Mitigation, 0).permutation(n);
                    for &row in &order[..(share * n as f64).round() as usize] {
                        values[row as usize * dim..][..dim].fill(0.0);
                    }
                }
            }
        }
        for (values, before) in values.chunks_mut(dim).zip(lengths) {
            let scale = before / length(values).max(1e-12);
            values.iter_mut().for_each(|x| *x *= scale);
        }
        let values = match descriptors.values() {
            // A cast saturates.
            Values::U8(_) => Values::U8(values.iter().map(|x| x.round() as u8).collect()),
            Values::F32(_) => Values::F32(values.iter().map(|&x| x as f32).collect()),
        };
        Descriptors::try_new(values, dim)
    }
}

fn length(values: &[f64]) -> f64 {
    values.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn step(text: &str) -> Result<Step, Error> {
    let wrong = || Error::new("mitigation", FORMS, text);
    let (name, rest) = text.trim().split_once(':').ok_or_else(wrong)?;
    let share = |text: &str| -> Option<f64> {
        let value = match text.split_once('/') {
            Some((above, below)) => above.parse::<f64>().ok()? / below.parse::<f64>().ok()?,
            None => text.parse().ok()?,
        };
        (value > 0.0 && value < 1.0).then_some(value)
    };
    let found = match (name, rest.split_once(':')) {
        ("thin", Some(("tracks", keep))) => {
            share(keep).map(|keep| Step::Thin { keep, by_tracks: true })
        }
        ("thin", None) => share(rest).map(|keep| Step::Thin { keep, by_tracks: false }),
        ("noise", None) => {
            rest.parse().ok().filter(|x| (0.0..=10.0).contains(x) && *x > 0.0).map(Step::Noise)
        }
        ("bits", None) => rest.parse().ok().filter(|n| (1..=7).contains(n)).map(Step::Bits),
        ("pca", None) => rest.parse().ok().filter(|n| *n > 0).map(Step::Pca),
        ("drop", None) => share(rest).map(Step::Drop),
        _ => None,
    };
    found.ok_or_else(wrong)
}

/// Rounds column `c` to `2^bits` levels: bins with equally many values, each at its mean.
fn quantize(values: &mut [f64], dim: usize, c: usize, bits: u32) {
    let n = values.len() / dim;
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| values[a * dim + c].total_cmp(&values[b * dim + c]));
    let levels = 1_usize << bits;
    let mut start = 0;
    for level in 1..=levels {
        let mut end = (level * n / levels).max(start);
        // Equal values have one level.
        let is_tied = |end: usize| values[order[end] * dim + c] == values[order[end - 1] * dim + c];
        while (start + 1..n).contains(&end) && is_tied(end) {
            end += 1;
        }
        let bin = &order[start..end];
        let mean = bin.iter().map(|&row| values[row * dim + c]).sum::<f64>() / bin.len() as f64;
        bin.iter().for_each(|&row| values[row * dim + c] = mean);
        start = end;
    }
}

/// Projects all rows to their mean plus the first `most` principal components.
fn project(values: &mut [f64], dim: usize, most: usize) -> Result<(), Error> {
    if most >= dim {
        return Err(Error::new("pca", format!("below {dim} components"), most));
    }
    let n = values.len() / dim;
    let mut mean = vec![0.0; dim];
    for row in values.chunks(dim) {
        mean.iter_mut().zip(row).for_each(|(mean, x)| *mean += x / n as f64);
    }
    let mut covariance = DMatrix::<f64>::zeros(dim, dim);
    for row in values.chunks(dim) {
        let away: Vec<f64> = row.iter().zip(&mean).map(|(x, mean)| x - mean).collect();
        for (c, column) in covariance.as_mut_slice().chunks_mut(dim).enumerate() {
            column.iter_mut().zip(&away).for_each(|(sum, x)| *sum += x * away[c]);
        }
    }
    let eigen = SymmetricEigen::new(covariance);
    let mut order: Vec<usize> = (0..dim).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    for row in values.chunks_mut(dim) {
        let away: Vec<f64> = row.iter().zip(&mean).map(|(x, mean)| x - mean).collect();
        row.copy_from_slice(&mean);
        for axis in order[..most].iter().map(|&at| eigen.eigenvectors.column(at)) {
            let along: f64 = axis.iter().zip(&away).map(|(a, x)| a * x).sum();
            row.iter_mut().zip(&axis).for_each(|(x, a)| *x += along * a);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::obfuscate::{Change, Changed, Scheme, obfuscate, olc};
    use crate::truth::{DropReason, Original};
    use crate::{PointSet, Unit, synthetic};

    fn mitigated(text: &str, tracks: Option<Vec<u32>>) -> Changed<3> {
        let mitigation = Mitigation::parse(text).unwrap();
        let change = Change::Mitigation(mitigation, tracks.map(Into::into));
        Changed::new(std::sync::Arc::new(olc::ENTRY), change)
    }

    #[test]
    fn names_are_plain_and_wrong_text_is_told() {
        let of = |text| mitigated(text, None).name().to_owned();
        assert_eq!(of("thin:1/4,bits:2"), "olc_thin4_bits2");
        assert_eq!(of("thin:tracks:1/4"), "olc_tracks4");
        assert_eq!(of("noise:0.1,pca:32,drop:0.5"), "olc_noise0.1_pca32_drop0.5");
        for wrong in ["", "thin", "thin:2", "bits:0", "bits:9", "pca:0", "drop:1", "noise:-1"] {
            let error = Mitigation::parse(wrong).unwrap_err().to_string();
            assert_eq!(error, format!("mitigation: expected {FORMS}, found {wrong}"));
        }
    }

    #[test]
    fn thinning_drops_points_with_a_reason_and_keeps_long_tracks() {
        let points = PointSet::try_new(synthetic::room(1, 400).points, Unit::Meter).unwrap();
        let n = points.len();
        let tracks: Vec<u32> = (0..n as u32).map(|row| row % 8).collect();
        let original = Original::new(points);
        let scheme = mitigated("thin:tracks:1/4", Some(tracks.clone()));
        let (_, secret) = obfuscate(&scheme, &original, None, &Key::from_seed(0)).unwrap();
        assert_eq!(secret.n_slots(), n / 4);
        assert_eq!(secret.dropped().len(), n - n / 4);
        assert!(secret.dropped().iter().all(|one| one.reason == DropReason::Thinned));
        let shortest = secret.hidden().iter().map(|id| tracks[id.index()]).min().unwrap();
        assert_eq!(shortest, 6);
        let without = mitigated("thin:tracks:1/4", None);
        let error = obfuscate(&without, &original, None, &Key::from_seed(0)).unwrap_err();
        assert_eq!(error.to_string(), "thin:tracks: expected a map with tracks, found none");
    }

    #[test]
    fn descriptor_steps_do_what_they_say() {
        let key = Key::from_seed(3);
        let values = (0..1600).map(|at| key.draws(Stage::Shapes, at).normal() as f32).collect();
        let before = Descriptors::try_new(Values::F32(values), 8).unwrap();
        let after = |text| -> Vec<Vec<f32>> {
            let mitigation = Mitigation::parse(text).unwrap();
            mitigation.descriptors(&before, &Key::from_seed(1)).unwrap().rows().collect()
        };
        let zeros = after("drop:0.25").iter().filter(|row| row.iter().all(|&x| x == 0.0)).count();
        assert_eq!(zeros, 50);
        // Before lengths are restored, a column has two levels of each sign.
        let signs = after("bits:1");
        assert!(signs.iter().flatten().all(|x| *x != 0.0));
        let before: Vec<Vec<f32>> = before.rows().collect();
        let mean = |other: &[Vec<f32>]| {
            let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>();
            let cosine =
                |(a, b): (&Vec<f32>, &Vec<f32>)| dot(a, b) / (dot(a, a) * dot(b, b)).sqrt();
            before.iter().zip(other).map(cosine).sum::<f32>() / 200.0
        };
        // A direction in 8 dimensions keeps about sqrt(6/8) of its length in 6 components.
        let projected = mean(&after("pca:6"));
        assert!((0.8..0.95).contains(&projected), "{projected}");
        let coarse = mean(&signs);
        assert!((0.7..0.9).contains(&coarse), "{coarse}");
        assert!(mean(&after("bits:4")) > 0.98);
        // The noise has the length 0.1 sqrt(8), so the cosine is near 1 / sqrt(1.08).
        let noisy = mean(&after("noise:0.1"));
        assert!((0.95..0.97).contains(&noisy), "{noisy}");
    }
}
