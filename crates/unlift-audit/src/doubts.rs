//! Doubts: reasons why figures may be too small, because the attack was not at its best, the ground
//! truth is of another map, or a released file gives away more than its records. Low recovery would
//! look like protection, so each doubt is shown beside the verdict, and no gate holds with one.

use std::borrow::Borrow;

use unlift::audit::{Alone, Plan, Row, Share, Threshold};
use unlift::evaluate::{
    OFF_RECORD, Truth, are_strangers, correlation, nearer_to_own, recovered_away,
};
use unlift::geometry::frame::Bounds;
use unlift::geometry::knn::Knn;
use unlift::geometry::vector::{along, distance, dot, median, sub};
use unlift::recover::Recovered;
use unlift::released::Released;
use unlift::truth::{Original, Secret};
use unlift::{Descriptors, PointSet, Unit};
use unlift_report::document::Input;

use crate::{Audit, Error};

/// Limits of delta, in multiples of the quartiles of the distance to the K-th neighbor; beyond them
/// the attack did not learn the distance of neighbors. On RedKitchen and Castle delta is 0.1
/// (`density`) to 4.8 times (`consensus`, noise `near`) the median distance, for all schemes,
/// solvers, sources and noise models.
const NARROW: f64 = 0.05;
const WIDE: f64 = 8.0;
/// Number of points or descriptors that are examined: enough for quartiles.
const SAMPLE: usize = 2000;
/// Tolerated share of points that are farther from their own records than the smallest threshold.
const STRAY: f64 = 0.01;
/// Usual median distance to the K-th neighbor in its own unit, whatever K the unit was made with.
const UNIT: [f64; 2] = [0.2, 5.0];
/// Lists are long if they name a larger share of the map than this (`tests/audit/doubts.rs` states the
/// cost).
const LONG: f64 = 0.05;
/// Lists of at most this length are never long.
const SHORT: usize = 5;

pub(crate) struct Doubts {
    pub(crate) of_rows: Vec<Option<String>>,
    pub(crate) all: Vec<String>,
    /// Notes of the whole audit: its doubts and others.
    pub(crate) notes: Vec<String>,
}

/// Finds the doubts about the figures of a map.
///
/// `spread` holds the distances of its points, `hidden` the given release, if it was not made here,
/// and `of_file` the doubts about the points. Deltas of tiles are checked one by one, because their
/// mean would hide a tile whose delta collapsed.
pub(crate) fn doubts(
    (original, spread): (&Original<3>, Spread),
    hidden: Option<&(Released<3>, Secret)>,
    (plan, rows, tile_rows): (&Plan<3>, &[Row], &[Vec<Row>]),
    of_file: &[String],
) -> Doubts {
    let Spread { low, middle, high, n_points } = spread;
    let unit = original.reveal().unit();
    let of_release = hidden.and_then(|(released, secret)| {
        let truth = Truth { original, released, secret };
        // A scheme's noise has a doubt of its own, and decoys hide no points.
        let is_usual = truth.is_noise() || released.obfuscation().is_bearings();
        let away = if is_usual { Vec::new() } else { truth.away_from_own() };
        rounded(truth.usual_rounding(), &plan.thresholds, released.unit())
            .or_else(|| strays(false, &away, &plan.thresholds, released.unit()))
            .or_else(|| mistaken_unit(unit, plan.k, middle))
    });
    let mut notes: Vec<String> = of_release.iter().chain(of_file).cloned().collect();
    let (of_map, mut of_rows, mut all) = (notes.first().cloned(), Vec::new(), notes.clone());
    let least = plan.thresholds.iter().map(|t| t.value).fold(f64::INFINITY, f64::min);
    let share = plan.k as f64 / n_points.max(1) as f64;
    if plan.asks_oracle() && plan.k > SHORT && share > LONG {
        notes.push(format!(
            "K = {} is {:.0} % of the map's points: such long lists may lower recovery (try a smaller --k)",
            plan.k,
            100.0 * share
        ));
    }
    let (shortest, longest) = (short(low), in_unit(high, unit));
    for row in rows {
        let of_tiles = tile_rows.iter().flatten().filter(|of_tile| of_tile.is_same_cell(row));
        let mut deltas = std::iter::once(row).chain(of_tiles).map(|row| row.delta);
        let unusual =
            deltas.find(|&delta| delta > 0.0 && !(NARROW * low..=WIDE * high).contains(&delta));
        let start = format!("{}: delta", row.scheme);
        let of_delta = unusual.map(|delta| in_unit(delta, unit)).map(|delta| {
            format!(
                "{start}, {delta}, is far from the usual distance to the K-th neighbor, {shortest} to {longest}: recovery may be \
                 too low (try --delta, or separate parts of the map)"
            )
        });
        // One line per scheme is enough.
        if !notes.iter().any(|note| note.starts_with(&start)) {
            notes.extend(of_delta.clone());
        }
        all.extend(of_delta.iter().cloned().chain(noise(row, least)));
        of_rows.push(of_map.clone().or(of_delta));
        notes.extend(noise(row, f64::INFINITY));
    }
    notes.dedup();
    Doubts { of_rows, all, notes }
}

/// Quartiles of the distance to the K-th neighbor.
pub(crate) struct Spread {
    low: f64,
    middle: f64,
    high: f64,
    /// Number of points of the map, or of its smallest part.
    n_points: usize,
}

impl Spread {
    /// Measures the spread of the parts of a map on a sample of their points. Neighbors are searched within a part.
    pub(crate) fn of<P: Borrow<PointSet<3>>>(
        parts: impl ExactSizeIterator<Item = Result<P, unlift::Error>>,
        k: usize,
    ) -> Result<Self, unlift::Error> {
        let of_each = SAMPLE.div_ceil(parts.len().max(1));
        let (mut distances, mut nearest, mut n_points) = (Vec::new(), Vec::new(), usize::MAX);
        for part in parts {
            let part = part?;
            let points = part.borrow().positions();
            let knn = Knn::new(points)?;
            let kth = |row: usize| {
                knn.nearest(row, k, &mut nearest);
                nearest.last().map_or(0.0, |last| last.0.sqrt())
            };
            let every = points.len().div_ceil(of_each).max(1);
            distances.extend((0..points.len()).step_by(every).map(kth));
            n_points = n_points.min(points.len());
        }
        distances.sort_unstable_by(f64::total_cmp);
        let last = distances.len().saturating_sub(1);
        let at = |rank: usize| distances.get(rank).copied().unwrap_or(0.0);
        Ok(Self { low: at(last / 4), middle: at(last / 2), high: at(last - last / 4), n_points })
    }
}

/// Nothing is measured if the median distance of points from their own records is this many times that to the K-th neighbor.
const APART: f64 = 4.0;

/// Returns an error if most points of the ground truth are far from their own records.
pub(crate) fn check_truth(
    original: &Original<3>,
    (released, secret): &(Released<3>, Secret),
    spread: &Spread,
) -> Result<(), unlift::Error> {
    let truth = Truth { original, released, secret };
    truth.belongs()?;
    let (middle, unit) = (median(&mut truth.away_from_own()), released.unit());
    let limit = APART * spread.middle;
    if middle <= limit || truth.is_noise() {
        return Ok(());
    }
    let expected = format!("records within {} of their own points", in_unit(limit, unit));
    let found = format!("{}: not measured (another unit, scale or frame?)", in_unit(middle, unit));
    Err(unlift::Error::new("truth", expected, found))
}

/// Returns a doubt if 32 bits round records by more than [`NOISE`] of the smallest threshold.
fn rounded(usual: f64, thresholds: &[Threshold], unit: Unit) -> Option<String> {
    let least = thresholds.iter().map(|t| t.value).fold(f64::INFINITY, f64::min);
    let by = in_unit(usual, unit);
    let doubt = format!(
        "released: coordinates are so large that 32 bits round them by about {by}: subtract a place in the map from \
         them, and write it as the array origin"
    );
    (usual > NOISE * least).then_some(doubt)
}

/// Returns a doubt about positions by their distances from their own records: the ground truth, or what was `recovered`.
fn strays(recovered: bool, away: &[f64], thresholds: &[Threshold], unit: Unit) -> Option<String> {
    let least = thresholds.iter().map(|t| t.value).fold(f64::INFINITY, f64::min);
    let (n, of) = (away.iter().filter(|&&away| away >= least).count(), away.len());
    let (what, where_, it_is) = match recovered {
        true => ("recovered", "where no hidden point is", "they are"),
        false => ("truth", "where no attack can find them", "it is"),
    };
    let least = in_unit(least, unit);
    let doubt = format!(
        "{what}: {n} of {of} points are {least} or more away from their own records, {where_}: check that {it_is} \
         of this map, in its frame, scale and order"
    );
    (n as f64 > STRAY * of as f64).then_some(doubt)
}

/// Returns a doubt if lengths are not in the unit that a file states.
fn mistaken_unit(unit: Unit, k: usize, middle: f64) -> Option<String> {
    let (is_usual, found) = ((UNIT[0]..=UNIT[1]).contains(&middle), short(middle));
    let doubt = format!(
        "unit: expected a usual distance to the K-th neighbor (K = {k}) of about 1, because the file \
         states lengths in multiples of it, found {found}: thresholds do not have their stated meaning"
    );
    (unit == Unit::KthNeighbor && !is_usual).then_some(doubt)
}

/// Number of other points with which a nearest point is compared.
const OTHERS: usize = 16;
/// Fewer points say nothing.
const FEWEST: f64 = 30.0;

/// Returns a doubt if descriptors are no more like those of the nearest points than like others, as in another order of rows.
pub fn unlike_neighbors(
    points: &PointSet<3>,
    descriptors: &Descriptors,
) -> Result<Option<String>, unlift::Error> {
    let (knn, n) = (Knn::new(points.positions())?, points.len());
    let (mut nearest, mut share, rows) =
        (Vec::new(), 0.0, (0..n).step_by(n.div_ceil(SAMPLE).max(1)));
    let n_rows = rows.len() as f64;
    for row in rows {
        knn.nearest(row, 1, &mut nearest);
        let like = |other: usize| descriptors.squared_distance(row, other);
        let near = nearest.first().map_or(f32::INFINITY, |near| like(near.1 as usize));
        let others = (1..=OTHERS).map(|at| like((row + 1 + at * (n - 1) / (OTHERS + 1)) % n));
        let more = |other: f32| if near == other { 0.5 } else { f64::from(near < other) };
        share += others.map(more).sum::<f64>() / (OTHERS as f64 * n_rows);
    }
    // The share of a point deviates by 0.3, so this is three deviations.
    let doubt = format!(
        "descriptors: {:.0} % are more like that of the nearest point than like another one, where 50 % are so by \
         chance: of another map, or in another order of rows?",
        100.0 * share
    );
    Ok((n_rows >= FEWEST && share < 0.5 + 0.9 / n_rows.sqrt()).then_some(doubt))
}

fn in_unit(length: f64, unit: Unit) -> String {
    with_sign(&short(length), unit)
}

fn with_sign(text: &str, unit: Unit) -> String {
    match unit {
        Unit::Meter | Unit::Pixel => format!("{text} {}", unit.name()),
        Unit::KthNeighbor => text.to_owned(),
    }
}

/// Checks by geometry that compared data belongs together, whatever the files state. Of data of
/// another map hardly anything is recovered, which would look like protection.
#[derive(Debug, Default)]
pub struct Checked {
    /// The number of positions nearer to their own point than to another one, and the number
    /// compared.
    nearer: (usize, usize),
    /// Distances of hidden points from their own records, if the records are given.
    truth: Vec<f64>,
    /// Distances of recovered positions from their own records, if the records are given.
    recovered: Vec<f64>,
}

impl Checked {
    /// Adds a map or an image.
    pub fn add<const D: usize>(
        &mut self,
        recovered: &Recovered<D>,
        original: &Original<D>,
        secret: &Secret,
        released: Option<&Released<D>>,
    ) -> Result<(), unlift::Error> {
        let (nearer, n) = nearer_to_own(recovered, original, secret, released);
        self.nearer = (self.nearer.0 + nearer, self.nearer.1 + n);
        if let Some(released) = released {
            let truth = Truth { original, released, secret };
            truth.belongs()?;
            self.truth.extend(truth.away_from_own());
            self.recovered.extend(recovered_away(released, recovered));
        }
        Ok(())
    }

    /// Returns the doubts about the figures.
    pub fn notes(
        &self,
        thresholds: &[Threshold],
        unit: Unit,
    ) -> Result<Vec<String>, unlift::Error> {
        if are_strangers(self.nearer) {
            let expected = "nearer to their own records or points than to those of others";
            let (nearer, n) = self.nearer;
            let found = format!("{nearer} of {n} (of another map, or in another order of rows)");
            return Err(unlift::Error::new("positions", expected, found));
        }
        let truth = strays(false, &self.truth, thresholds, unit);
        let recovered = strays(true, &self.recovered, thresholds, unit);
        Ok(truth.into_iter().chain(recovered).collect())
    }
}

/// Returns `input` with the sides of the box around all points but the outer 1 % of each axis.
pub fn with_sides(input: Input, points: &PointSet<3>) -> Input {
    let bounds = Bounds::quantiles(points.positions(), 0.01);
    let sides = bounds.map(|bounds| sub(&bounds.high, &bounds.low));
    let longest_side = sides.map(|sides| sides.into_iter().fold(0.0, f64::max));
    match points.unit() {
        Unit::Meter => Input { extent_m: sides, longest_side: None, ..input },
        _ => Input { extent_m: None, longest_side, ..input },
    }
}

/// Returns the median distance to the nearest other point.
pub(crate) fn nearest(points: &[[f64; 3]]) -> Result<f64, unlift::Error> {
    Ok(median(&mut Knn::new(points)?.kth_distances(1)))
}

/// Returns twice the distance from the median point within which 90 % of the points lie, so that a few
/// outliers do not count.
fn across(points: &[[f64; 3]]) -> f64 {
    if points.is_empty() {
        return 0.0;
    }
    let middle =
        [0, 1, 2].map(|axis| median(&mut points.iter().map(|p| p[axis]).collect::<Vec<_>>()));
    let mut distances: Vec<f64> = points.iter().map(|p| distance(p, &middle)).collect();
    let at = (distances.len() - 1) * 9 / 10;
    2.0 * *distances.select_nth_unstable_by(at, f64::total_cmp).1
}

/// Plausible sizes of a map in meters: from a grain of dust to beyond the orbit of the moon.
const ACROSS_M: [f64; 2] = [1e-6, 1e9];
/// If nearest neighbors are this many times the largest threshold apart, no attack can come near
/// ([`HOPELESS`]), or the lengths are doubtful ([`UNUSUAL`]).
pub(crate) const HOPELESS: f64 = 100.0;
const UNUSUAL: f64 = 10.0;

/// Checks a scale against the points as they were read.
///
/// # Errors
/// If it makes the map smaller than dust or larger than the orbit of the moon.
pub fn check_scale(points: &[[f64; 3]], scale: Option<f64>) -> Result<(), Error> {
    let Some(scale) = scale else { return Ok(()) };
    let across = across(points);
    let [min, max] = ACROSS_M;
    // Coincident points have their own error.
    if across == 0.0 || (min..=max).contains(&(across * scale)) {
        return Ok(());
    }
    let error = Error::request(format!(
        "--scale {scale:e}: expected {:.1e} to {:.1e} meters per unit, as the map is {} units across, found {scale:e}",
        min / across,
        max / across,
        short(across),
    ));
    Err(error.advise("--scale 1 for a map in meters, or no --scale for relative lengths"))
}

/// Checks thresholds against the points, in the unit of the audit. Adds a note to `audit` if figures may be too large, and a doubt
/// if they may be too small. Default thresholds in a relative unit always fit.
///
/// # Errors
/// If any guess would count as recovered, or no attack could come near.
pub fn check_thresholds(
    audit: &mut Audit,
    points: &PointSet<3>,
    thresholds: &[Threshold],
    typed: bool,
) -> Result<(), Error> {
    let unit = points.unit();
    let by_size = |a: &&Threshold, b: &&Threshold| a.value.total_cmp(&b.value);
    let (Some(smallest), Some(largest), true) = (
        thresholds.iter().min_by(by_size),
        thresholds.iter().max_by(by_size),
        unit == Unit::Meter || typed,
    ) else {
        return Ok(());
    };
    let (nearest, across) = (nearest(points.positions())?, across(points.positions()));
    let option = if typed { "--thresholds" } else { "--scale" };
    let times = match unit {
        Unit::KthNeighbor => " times the usual distance to the K-th neighbor",
        Unit::Meter | Unit::Pixel => "",
    };
    let [across_text, nearest_text] = [across, nearest].map(|x| in_unit(x, unit) + times);
    let [smallest_text, largest_text] = [smallest, largest].map(|t| with_sign(&t.label, unit));
    let error = |text: String| {
        Error::request(format!("{option}: expected {text}")).advise(match unit {
            Unit::Meter => "another --scale (meters per unit of the map), or other --thresholds",
            Unit::KthNeighbor | Unit::Pixel => "other --thresholds, or none for the usual ones",
        })
    };
    if across > 0.0 && smallest.value >= across {
        return Err(error(format!(
            "a map larger than the smallest threshold, {smallest_text}, found one {across_text} across: any guess \
             would count as recovered"
        )));
    }
    if nearest >= HOPELESS * largest.value {
        return Err(error(format!(
            "points less than {HOPELESS} times the largest threshold, {largest_text}, from their nearest neighbors, \
             found {nearest_text}: no attack could come near"
        )));
    }
    if across > 0.0 && largest.value >= across {
        audit.notes.push(format!(
            "the map is {across_text} across, less than the threshold {largest_text}: within it any guess counts as recovered"
        ));
    } else if nearest >= UNUSUAL * largest.value {
        audit.doubts.push(format!(
            "lengths are doubtful: points are {nearest_text} from their nearest neighbors, far more than the largest threshold, \
             {largest_text}: is {option} right?"
        ));
    }
    Ok(())
}

/// Share of a threshold that noise of records may take. Attacks stay on records, and others may average noise away.
const NOISE: f64 = 0.1;

/// Returns a line about a row whose points are off their records, if that matters within `threshold`; always if it is infinite.
pub(crate) fn noise(row: &Row, threshold: f64) -> Option<String> {
    let off = *row.metrics.get(OFF_RECORD)?;
    let (scheme, away) = (&row.scheme, in_unit(off, row.unit));
    let doubt = format!(
        "{scheme}: half of the points are {away} or more off their records, as by noise: attacks here stay on the records, \
         others may average the noise away"
    );
    (!threshold.is_finite() || off > NOISE * threshold).then_some(doubt)
}

/// Formats three digits, with an exponent where there would be many zeros.
pub(crate) fn short(length: f64) -> String {
    if (1e-3..1e6).contains(&length) || length == 0.0 {
        let digits = (2 - length.max(1e-3).log10().floor() as i32).clamp(0, 6) as usize;
        return format!("{length:.digits$}");
    }
    format!("{length:.1e}")
}

/// A column of descriptors follows the places if its correlation with a coordinate is this large. Real maps have 0.36 or less,
/// made-up descriptors that change smoothly up to 0.81.
const FOLLOWS: f64 = 0.9;

/// Rounding of published positions, as a part of the largest coordinate and of the size of the map: that of 32-bit floats.
const ROUNDING: f64 = f32::EPSILON as f64;
/// Points lie at a fixed distance along published vectors if this share does.
const MOST: f64 = 0.5;

/// Measures the attack that takes published values for the points: each of `published` has a position per record. Of a pair, the
/// values are those of its two points in any order. A value that is a point of the map counts, whichever record publishes it. Between
/// two positions that a record publishes, points may also lie at a distance that the scheme fixes.
pub(crate) fn read_from_file(
    published: &[Vec<[f64; 3]>],
    original: &Original<3>,
    secret: &Secret,
    thresholds: &[Threshold],
) -> Option<Alone> {
    let slots = secret.slots_per_record();
    let point = |slot: usize| &original.reveal().positions()[secret.hidden()[slot].index()];
    let fixed = match published {
        [from, to] if slots == 1 => at_fixed_distances(from, to, point).to_vec(),
        _ => Vec::new(),
    };
    let columns: Vec<&[Vec<[f64; 3]>]> = match slots {
        1 => published.chunks(1).collect(),
        _ => vec![published],
    };
    let points = original.reveal().positions();
    let largest = points.iter().flatten().fold(across(points), |most, x| most.max(x.abs()));
    let least = thresholds.iter().map(|t| t.value).fold(f64::INFINITY, f64::min);
    let rounding = (ROUNDING * largest).min(least);
    let (all, values) = (Knn::new(points).ok(), published.iter().flatten().copied());
    let is_within = |at: [f64; 3], of: &Option<Knn<'_, 3>>, threshold: f64| {
        of.as_ref().is_some_and(|of| nearest_to(at, of) <= threshold)
    };
    let open: Vec<[f64; 3]> = values.filter(|&value| is_within(value, &all, rounding)).collect();
    let open = Knn::new(&open).ok();
    let within = |columns: &[Vec<[f64; 3]>], threshold: f64| {
        let is_near = |&slot: &usize| {
            columns.iter().any(|rows| distance(&rows[slot / slots], point(slot)) <= threshold)
                || is_within(*point(slot), &open, threshold)
        };
        (0..secret.n_slots()).filter(is_near).count()
    };
    let is_rule = |of: &&[Vec<[f64; 3]>]| within(of, least) as f64 > MOST * secret.n_slots() as f64;
    let columns: Vec<_> = columns.iter().copied().chain(fixed.chunks(1).filter(is_rule)).collect();
    let best = |t: &Threshold| {
        let n = columns.iter().map(|of| within(of, t.value)).max().unwrap_or(0);
        (t.label.clone(), Share::of(n as f64, secret.n_slots() as f64))
    };
    let shares = thresholds.iter().map(best).collect();
    (!published.is_empty()).then_some(Alone { name: "read from the file", shares })
}

/// Returns the places at a fixed multiple of the vector from `from` to `to`, at a fixed distance along it, and at a fixed multiple of its
/// inverse: with the median of the values that lead to each record's point.
fn at_fixed_distances<'a>(
    from: &[[f64; 3]],
    to: &[[f64; 3]],
    point: impl Fn(usize) -> &'a [f64; 3],
) -> [Vec<[f64; 3]>; 3] {
    let vectors: Vec<[f64; 3]> = from.iter().zip(to).map(|(from, to)| sub(to, from)).collect();
    [0, -1, -2].map(|power| {
        let step = |row: usize| {
            let length2 = dot(&vectors[row], &vectors[row]);
            along(&[0.0; 3], length2.powf(0.5 * f64::from(power)), &vectors[row])
        };
        let multiple = |row: usize| {
            let step = step(row);
            dot(&sub(point(row), &from[row]), &step) / dot(&step, &step)
        };
        let mut multiples: Vec<f64> =
            (0..from.len()).map(multiple).filter(|x| x.is_finite()).collect();
        let usual = if multiples.is_empty() { 0.0 } else { median(&mut multiples) };
        (0..from.len()).map(|row| along(&from[row], usual, &step(row))).collect()
    })
}

/// Returns the distance from a position to the nearest of `points`.
pub(crate) fn nearest_to(position: [f64; 3], points: &Knn<'_, 3>) -> f64 {
    let mut near = Vec::new();
    points.nearest_to(position, 1, &mut near);
    near.first().map_or(f64::INFINITY, |nearest| nearest.0.sqrt())
}

/// Returns doubts about released data whose rows or columns follow the places of the points, which no attack uses.
pub(crate) fn follows_places(
    original: &Original<3>,
    (released, secret): &(Released<3>, Secret),
) -> Vec<String> {
    let points = original.reveal().positions();
    let point = |slot: usize| &points[secret.hidden()[slot].index()];
    let (n, slots) = (released.n_records(), secret.slots_per_record());
    let record = |at: usize| point(at % n * slots);
    let nearer = |at: &usize| {
        let away = |by: usize| distance(record(*at), record(at + by));
        away(1) < away(n / 2)
    };
    let n_nearer = (0..n).filter(nearer).count();
    // By chance a half; the margin is five standard deviations.
    let is_ordered = n_nearer as f64 > 0.5 * n as f64 + 2.5 * (n as f64).sqrt();
    let order = format!(
        "order of records: in {n_nearer} of {n} cases, the next record is nearer than another one (by chance, in half of \
         them): the order gives places away, and no attack uses it (release records in random order)"
    );
    let columns = released.descriptors().into_iter().flat_map(|rows| columns(rows, secret, points));
    is_ordered.then_some(order).into_iter().chain(columns).collect()
}

/// Returns a doubt about each column of descriptors that follows a coordinate.
fn columns(rows: &Descriptors, secret: &Secret, points: &[[f64; 3]]) -> Vec<String> {
    let slots = (0..secret.n_slots()).step_by(secret.n_slots().div_ceil(SAMPLE).max(1));
    let (mut values, mut row) = (vec![Vec::new(); rows.dim()], vec![0.0; rows.dim()]);
    for slot in slots.clone() {
        rows.read_row(secret.descriptor_row()[slot] as usize, &mut row);
        values.iter_mut().zip(&row).for_each(|(column, &value)| column.push(f64::from(value)));
    }
    let places: [Vec<f64>; 3] =
        [0, 1, 2].map(|c| slots.clone().map(|s| points[secret.hidden()[s].index()][c]).collect());
    let doubt = |at: usize| {
        let of = |axis: usize| (axis, correlation(&values[at], &places[axis]));
        let (axis, r) = (0..3).map(of).find(|(_, r)| r.abs() > FOLLOWS)?;
        Some(format!(
            "descriptors: column {at} (from 0) follows the coordinate {} (correlation {r:.2}), which no attack here reads: \
             leave it out",
            ["x", "y", "z"][axis]
        ))
    };
    (0..values.len()).filter_map(doubt).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Output;
    use unlift::audit::{Silent, run};
    use unlift::recover::Builtin;
    use unlift::synthetic;

    #[test]
    fn a_tile_whose_delta_collapsed_is_a_doubt_though_the_mean_is_usual() {
        let set = PointSet::try_new(synthetic::room(4, 600).points, Unit::Meter).unwrap();
        let original = Original::new(set);
        let mut plan = Plan::<3>::new(Unit::Meter);
        plan.schemes.truncate(1);
        (plan.k, plan.inlier_ratios, plan.records_alone) = (10, vec![1.0], false);
        plan.solvers = Builtin::list(&[Builtin::Consensus]);
        let rows = run(&original, None, &plan, &mut Silent).unwrap().rows;
        let of = |tile_rows: &[Vec<Row>]| {
            let spread = Spread::of(std::iter::once(Ok(original.reveal())), plan.k).unwrap();
            doubts((&original, spread), None, (&plan, &rows, tile_rows), &[]).of_rows
        };
        assert_eq!(of(std::slice::from_ref(&rows)), [None]);
        let collapsed = vec![Row { delta: 1e-6, ..rows[0].clone() }];
        assert!(of(&[rows.clone(), collapsed])[0].is_some());
    }

    #[test]
    fn points_at_a_fixed_distance_along_published_vectors_are_read() {
        let (from, towards) = (room(1.0), room(0.3));
        let to: Vec<[f64; 3]> = from.iter().zip(&towards).map(|(x, v)| along(x, 1.0, v)).collect();
        for (at, power) in [0.0, -1.0, -2.0].into_iter().enumerate() {
            let multiple = |v: &[f64; 3]| 7.0 * dot(v, v).powf(0.5 * power);
            let hidden = from.iter().zip(&towards).map(|(x, v)| along(x, multiple(v), v));
            let hidden: Vec<[f64; 3]> = hidden.collect();
            let read = &at_fixed_distances(&from, &to, |row| &hidden[row])[at];
            assert!(read.iter().zip(&hidden).all(|(a, b)| distance(a, b) < 1e-9), "{power}");
        }
    }

    fn room(scale: f64) -> Vec<[f64; 3]> {
        synthetic::room(0, 2000).points.iter().map(|p| p.map(|x| x * scale)).collect()
    }

    /// Returns the notes and doubts, or the error.
    fn checked(
        scale: f64,
        unit: Unit,
        labels: [&str; 2],
        typed: bool,
    ) -> Result<[Vec<String>; 2], String> {
        let points = PointSet::try_new(room(scale), unit).unwrap();
        let thresholds = labels.map(|label| Threshold::parse(label).unwrap());
        let mut audit = Audit::new(Output::new("".as_ref()));
        check_thresholds(&mut audit, &points, &thresholds, typed)
            .map(|()| [audit.notes, audit.doubts])
            .map_err(|error| error.to_string())
    }

    #[test]
    fn the_extent_of_a_map_is_that_of_most_points() {
        // Georeferenced coordinates are large although the map is not; an outlier does not count.
        let mut far: Vec<_> = room(1.0).iter().map(|p| p.map(|x| x + 5e6)).collect();
        far.push([1e15; 3]);
        check_scale(&far, Some(1.0)).unwrap();
    }

    #[test]
    fn thresholds_that_mean_nothing_for_a_map_are_refused_or_noted() {
        let usual = |scale| checked(scale, Unit::Meter, ["0.10", "0.25"], false);
        let nothing = || Ok([const { Vec::new() }; 2]);
        assert_eq!(usual(1.0), nothing());
        // The larger threshold alone gives a note.
        let [notes, doubts] = usual(0.03).unwrap();
        assert!(doubts.is_empty() && notes[0].contains("less than the threshold 0.25 m"));
        let [notes, doubts] = usual(100.0).unwrap();
        assert!(notes.is_empty() && doubts[0].ends_with("is --scale right?"), "{doubts:?}");
        // Thresholds as typed are checked in any unit.
        let of = |labels, typed| checked(20.0, Unit::KthNeighbor, labels, typed);
        for labels in [["1e300", "1e301"], ["1e-300", "1e-9"]] {
            assert!(of(labels, true).unwrap_err().starts_with("--thresholds: expected"));
            assert_eq!(of(labels, false), nothing());
        }
        assert_eq!(of(["1.0", "2.5"], true), nothing());
    }

    #[test]
    fn lengths_have_three_digits() {
        let texts = [0.0154, 1.5, 85.23, 15_400.0, 3e-300, 7.2e9].map(short);
        assert_eq!(texts, ["0.0154", "1.50", "85.2", "15400", "3.0e-300", "7.2e9"]);
    }
}
