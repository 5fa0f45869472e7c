//! Break-even ratio of a scheme: the lowest inlier ratio at which half of the points come back.

use serde::{Deserialize, Serialize};

use super::plan::Plan;
use super::row::Row;

/// Largest difference of two tested ratios to interpolate between. Shares fall late, so a line over a wide gap would overstate safety.
const MAX_GAP: f64 = 0.3;

/// Percentage of recovered points at break-even.
const HALF: f64 = 50.0;

/// Relation of a break-even ratio to the tested inlier ratios.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Bound {
    /// Interpolated between two tested ratios.
    Interpolated,
    /// Half or more come back at the stated ratio, and no ratio a little below it was tested.
    BelowTested,
    /// Fewer than half come back at every tested ratio; the highest is stated.
    AboveTested,
}

/// The lowest inlier ratio at which half of the points come back within a threshold.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BreakEven {
    /// Scheme name.
    pub scheme: String,
    /// Solver name, or [`STRONGEST`].
    pub solver: String,
    /// Noise model of the oracle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub oracle_noise: Option<String>,
    /// Threshold label.
    pub threshold: String,
    /// The ratio, linearly interpolated, or the tested ratio that bounds it.
    pub inlier_ratio: f64,
    /// Relation of the ratio to the tested ones.
    pub bound: Bound,
}

/// Name in place of a solver's name: the strongest attack at each ratio.
pub const STRONGEST: &str = "strongest";

/// Computes break-even ratios within the headline threshold per scheme and noise model.
///
/// The first is that of the strongest attack at each ratio, if there are several; then one per
/// solver. The strongest attack includes both baselines, because an attacker need not use lists.
pub fn break_even<const D: usize>(plan: &Plan<D>, rows: &[Row]) -> Vec<BreakEven> {
    let mut result = Vec::new();
    for scheme in &plan.schemes {
        for noise in &plan.oracle_noise {
            let (scheme, oracle_noise) = (scheme.name(), noise.name());
            let of = |row: &&Row| {
                row.scheme == scheme && row.oracle_noise.as_deref() == Some(oracle_noise)
            };
            let threshold = &plan.thresholds[plan.headline].label;
            let by_rows = |row: &Row| row.recovered_percent[threshold];
            let by_any = |row: &Row| {
                row.baseline_percent(threshold).map_or(by_rows(row), |base| by_rows(row).max(base))
            };
            let mut push = |solver: &str, rows: &[&Row], share: &dyn Fn(&Row) -> f64| {
                if let Some((inlier_ratio, bound)) = crossing(&curve(rows, share)) {
                    result.push(BreakEven {
                        scheme: scheme.to_owned(),
                        solver: solver.to_owned(),
                        oracle_noise: Some(oracle_noise.to_owned()),
                        threshold: threshold.clone(),
                        inlier_ratio,
                        bound,
                    });
                }
            };
            let all: Vec<&Row> = rows.iter().filter(of).collect();
            let differs = crossing(&curve(&all, &by_any)) != crossing(&curve(&all, &by_rows));
            if plan.solvers.len() > 1 || differs {
                push(STRONGEST, &all, &by_any);
            }
            for solver in plan.solvers.iter().map(|solver| solver.name()) {
                let of_solver = |row: &&Row| row.solver == solver;
                push(solver, &all.iter().copied().filter(of_solver).collect::<Vec<_>>(), &by_rows);
            }
        }
    }
    result
}

/// Returns (ratio, largest share at this ratio) of `rows`, in descending order of the ratio.
fn curve(rows: &[&Row], share: &dyn Fn(&Row) -> f64) -> Vec<(f64, f64)> {
    let mut curve: Vec<(f64, f64)> =
        rows.iter().map(|row| (row.inlier_ratio, share(row))).collect();
    // `dedup_by` keeps the first of equal ratios: the one with the largest share.
    curve.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(b.1.total_cmp(&a.1)));
    curve.dedup_by(|later, kept| later.0 == kept.0);
    curve
}

/// Returns the lowest ratio at which the curve, linear between tested ratios, reaches one half.
///
/// `curve` descends in ratio. It may cross one half several times, because shares vary by a few
/// points between random seeds. Any higher crossing would overstate safety.
fn crossing(curve: &[(f64, f64)]) -> Option<(f64, Bound)> {
    let first = curve.first()?;
    let Some(at) = curve.iter().rposition(|(_, share)| *share >= HALF) else {
        return Some((first.0, Bound::AboveTested));
    };
    let above = curve[at];
    let Some(below) = curve.get(at + 1).filter(|below| above.0 - below.0 < MAX_GAP) else {
        return Some((above.0, Bound::BelowTested));
    };
    let share = (above.1 - HALF) / (above.1 - below.1);
    Some((above.0 + share * (below.0 - above.0), Bound::Interpolated))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lowest_crossing_of_half_counts() {
        use Bound::{AboveTested, BelowTested, Interpolated};
        for (curve, expected) in [
            (&[(1.0, 90.0), (0.5, 70.0), (0.3, 40.0)][..], (0.5 - 0.4 / 3.0, Interpolated)),
            (&[(1.0, 90.0), (0.1, 60.0)], (0.1, BelowTested)),
            (&[(0.5, 90.0), (0.1, 10.0)], (0.5, BelowTested)),
            (&[(1.0, 40.0), (0.1, 10.0)], (1.0, AboveTested)),
            // `ray-voxel` by `consensus` on a real map: the highest ratio gives a smaller share.
            (&[(1.0, 48.1), (0.75, 52.3), (0.5, 50.0)], (0.5, BelowTested)),
            (&[(1.0, 48.1), (0.75, 52.3), (0.5, 50.0), (0.3, 40.0)], (0.5, Interpolated)),
            (&[(1.0, 90.0), (0.75, 49.0), (0.5, 60.0), (0.3, 40.0)], (0.4, Interpolated)),
            // A share that is no number hides no other.
            (&[(1.0, f64::NAN), (0.5, 60.0), (0.3, 40.0)], (0.4, Interpolated)),
        ] {
            let (ratio, bound) = crossing(curve).unwrap();
            assert!((ratio - expected.0).abs() < 1e-12, "{curve:?}: {ratio}");
            assert_eq!(bound, expected.1, "{curve:?}");
        }
        assert_eq!(crossing(&[]), None);
    }
}
