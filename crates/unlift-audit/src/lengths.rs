//! Checks that a declared scale and thresholds fit a map. If any guess counts as recovered, or no
//! attack can come near, a figure means nothing, and 0 % would look like protection.

use unlift::audit::Threshold;
use unlift::geometry::knn::Knn;
use unlift::geometry::vector::median;
use unlift::{PointSet, Unit};

use crate::Error;
use crate::gate::Gate;

/// The size of a map and the distance of its points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Twice the distance from the median point within which 90 % of the points lie, so that a few
    /// outliers do not count.
    pub across: f64,
    /// The median distance to the nearest other point.
    pub nearest: f64,
}

impl Extent {
    /// Measures `points`, at least two.
    ///
    /// # Errors
    /// If a coordinate is not finite.
    pub fn of(points: &[[f64; 3]]) -> Result<Self, unlift::Error> {
        let nearest = median(&mut Knn::new(points)?.kth_distances(1));
        Ok(Self { across: across(points), nearest })
    }
}

fn across(points: &[[f64; 3]]) -> f64 {
    if points.is_empty() {
        return 0.0;
    }
    let middle: [f64; 3] = std::array::from_fn(|axis| {
        let mut coordinates: Vec<f64> = points.iter().map(|p| p[axis]).collect();
        median(&mut coordinates)
    });
    let distance = |p: &[f64; 3]| -> f64 {
        (0..3).map(|axis| (p[axis] - middle[axis]).powi(2)).sum::<f64>().sqrt()
    };
    let mut distances: Vec<f64> = points.iter().map(distance).collect();
    let at = (distances.len() - 1) * 9 / 10;
    2.0 * *distances.select_nth_unstable_by(at, f64::total_cmp).1
}

/// Plausible sizes of a map in meters: from a grain of dust to beyond the orbit of the moon.
const ACROSS_M: [f64; 2] = [1e-6, 1e9];
/// If nearest neighbors are this many times the largest threshold apart, no attack can come near
/// ([`HOPELESS`]), or the lengths are doubtful ([`UNUSUAL`]).
const HOPELESS: f64 = 100.0;
const UNUSUAL: f64 = 10.0;

/// Checks a scale against the points as they were read.
///
/// # Errors
/// If it makes the map smaller than dust or larger than the orbit of the moon.
pub fn check_scale(points: &[[f64; 3]], scale: Option<f64>) -> Result<(), Error> {
    let Some(scale) = scale else { return Ok(()) };
    let across = across(points);
    let [least, most] = ACROSS_M;
    // Coincident points have their own error.
    if across == 0.0 || (least..=most).contains(&(across * scale)) {
        return Ok(());
    }
    let error = Error::request(format!(
        "--scale {scale:e}: expected {:.1e} to {:.1e} meters per unit, as the map is {} units across, found {scale:e}",
        least / across,
        most / across,
        short(across),
    ));
    Err(error.advise("--scale 1 for a map in meters, or no --scale for relative lengths"))
}

/// Messages about lengths: a note, and a doubt, with which no gate holds.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct SaidOfLengths {
    /// Figures may be too large.
    pub note: Option<String>,
    /// Figures may be too small.
    pub doubt: Option<String>,
}

/// Checks thresholds against the points, in the unit of the audit. Default thresholds in a relative
/// unit always fit.
///
/// # Errors
/// If any guess would count as recovered, or no attack could come near.
pub fn check_thresholds(
    points: &[[f64; 3]],
    unit: Unit,
    thresholds: &[Threshold],
    typed: bool,
) -> Result<SaidOfLengths, Error> {
    if unit != Unit::Meter && !typed {
        return Ok(SaidOfLengths::default());
    }
    let by_size = |a: &&Threshold, b: &&Threshold| a.value.total_cmp(&b.value);
    let (Some(least), Some(most)) =
        (thresholds.iter().min_by(by_size), thresholds.iter().max_by(by_size))
    else {
        return Ok(SaidOfLengths::default());
    };
    let Extent { across, nearest } = Extent::of(points)?;
    let option = if typed { "--thresholds" } else { "--scale" };
    let in_unit = |length: f64| match unit {
        Unit::Meter => format!("{} m", short(length)),
        Unit::Pixel => format!("{} px", short(length)),
        Unit::KthNeighbor => {
            format!("{} times the usual distance to the K-th neighbor", short(length))
        }
    };
    let named = |threshold: &Threshold| match unit {
        Unit::Meter => format!("{} m", threshold.label),
        Unit::Pixel => format!("{} px", threshold.label),
        Unit::KthNeighbor => threshold.label.clone(),
    };
    let way_out = match unit {
        Unit::Meter => "another --scale (meters per unit of the map), or other --thresholds",
        Unit::KthNeighbor | Unit::Pixel => "other --thresholds, or none for the usual ones",
    };
    if across > 0.0 && least.value >= across {
        let error = Error::request(format!(
            "{option}: expected a map larger than the smallest threshold, {}, found one {} across: any guess \
             would count as recovered",
            named(least),
            in_unit(across),
        ));
        return Err(error.advise(way_out));
    }
    if nearest >= HOPELESS * most.value {
        let error = Error::request(format!(
            "{option}: expected points less than {HOPELESS} times the largest threshold, {}, from their nearest neighbors, \
             found {}: no attack could come near",
            named(most),
            in_unit(nearest),
        ));
        return Err(error.advise(way_out));
    }
    if across > 0.0 && most.value >= across {
        let note = format!(
            "the map is {} across, less than the threshold {}: within it any guess counts as recovered",
            in_unit(across),
            named(most),
        );
        return Ok(SaidOfLengths { note: Some(note), doubt: None });
    }
    if nearest >= UNUSUAL * most.value {
        let doubt = format!(
            "lengths are doubtful: points are {} from their nearest neighbors, far more than the largest threshold, {}: is \
             {option} right?",
            in_unit(nearest),
            named(most),
        );
        return Ok(SaidOfLengths { note: None, doubt: Some(doubt) });
    }
    Ok(SaidOfLengths::default())
}

/// Checks the thresholds of gates: a gate that no attack can break means nothing.
pub(crate) fn check_lengths_of_gates(points: &PointSet<3>, gates: &[Gate]) -> Result<(), Error> {
    let by_size = |a: &&Gate, b: &&Gate| a.threshold.total_cmp(&b.threshold);
    let Some(gate) = gates.iter().min_by(by_size) else { return Ok(()) };
    let nearest = Extent::of(points.positions())?.nearest;
    if nearest < HOPELESS * gate.threshold {
        return Ok(());
    }
    Err(Error::request(format!(
        "--gate {}: expected points less than {HOPELESS} times its threshold from their nearest neighbors, found {} times: \
         no attack could come near",
        gate.typed,
        short(nearest / gate.threshold)
    )))
}

/// Formats three digits, with an exponent where there would be many zeros.
pub(crate) fn short(length: f64) -> String {
    if (1e-3..1e6).contains(&length) || length == 0.0 {
        let digits = (2 - length.max(1e-3).log10().floor() as i32).clamp(0, 6) as usize;
        return format!("{length:.digits$}");
    }
    format!("{length:.1e}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use unlift::synthetic;

    fn room(scale: f64) -> Vec<[f64; 3]> {
        synthetic::room(0, 2000).points.iter().map(|p| p.map(|x| x * scale)).collect()
    }

    fn thresholds(labels: &[&str]) -> Vec<Threshold> {
        labels.iter().map(|label| Threshold::parse(label).unwrap()).collect()
    }

    fn told(scale: f64) -> Result<SaidOfLengths, String> {
        let usual = thresholds(&["0.10", "0.25"]);
        check_thresholds(&room(scale), Unit::Meter, &usual, false).map_err(|e| e.to_string())
    }

    #[test]
    fn scales_that_make_a_map_of_nothing_or_of_everything_are_refused() {
        let points = room(1.0);
        for scale in [1e-300, 1e-9, 1e10, 1e300] {
            let error = check_scale(&points, Some(scale)).unwrap_err().to_string();
            assert!(error.starts_with(&format!("--scale {scale:e}: expected")), "{error}");
        }
        for scale in [None, Some(1e-3), Some(1.0), Some(1000.0)] {
            check_scale(&points, scale).unwrap();
        }
        // Georeferenced coordinates are large although the map is not; an outlier does not count.
        let mut far: Vec<_> = points.iter().map(|p| p.map(|x| x + 5e6)).collect();
        far.push([1e15; 3]);
        check_scale(&far, Some(1.0)).unwrap();
    }

    #[test]
    fn a_map_within_the_smallest_threshold_is_refused() {
        let error = told(0.01).unwrap_err();
        assert!(error.starts_with("--scale: expected a map larger than"), "{error}");
        assert!(error.ends_with("any guess would count as recovered"), "{error}");
        // The larger threshold alone gives a note.
        let note = told(0.03).unwrap().note.unwrap();
        assert!(note.contains("less than the threshold 0.25 m"), "{note}");
        assert_eq!(told(1.0), Ok(SaidOfLengths::default()));
    }

    #[test]
    fn points_too_far_apart_for_any_threshold_are_refused() {
        let error = told(1_000.0).unwrap_err();
        assert!(error.contains("expected points less than 100 times"), "{error}");
        let note = told(100.0).unwrap().doubt.unwrap();
        assert!(note.ends_with("is --scale right?"), "{note}");
    }

    #[test]
    fn thresholds_as_typed_are_checked_in_any_unit() {
        let of = |labels: &[&str], typed| {
            let thresholds = thresholds(labels);
            check_thresholds(&room(20.0), Unit::KthNeighbor, &thresholds, typed)
                .map_err(|error| error.to_string())
        };
        for labels in [["1e300", "1e301"], ["1e-300", "1e-9"]] {
            assert!(of(&labels, true).unwrap_err().starts_with("--thresholds: expected"));
            assert_eq!(of(&labels, false), Ok(SaidOfLengths::default()));
        }
        assert_eq!(of(&["1.0", "2.5"], true), Ok(SaidOfLengths::default()));
    }

    #[test]
    fn lengths_have_three_digits() {
        let texts = [0.0154, 1.5, 85.23, 15_400.0, 3e-300, 7.2e9].map(short);
        assert_eq!(texts, ["0.0154", "1.50", "85.2", "15400", "3.0e-300", "7.2e9"]);
    }
}
