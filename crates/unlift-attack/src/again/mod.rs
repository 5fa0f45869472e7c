//! Recovery of a map that was released twice: the two records of a point meet in it.
//!
//! ```text
//! two releases ──links by descriptors, or by geometry alone──> pairs of records ──meet──> points
//! ```
//!
//! - Two lines, or two rays from different centers, meet in the point. Wrong pairs pass each other.
//! - A line and a plane always meet in one point.
//! - Two planes of different axes leave a line, two of one axis leave the plane. Two rays from one center leave the ray.
//! - Two points with swapped coordinates differ in the swapped ones, and the records of their partners tell which is right (`swaps`).

mod meet;
mod swaps;

use crate::geometry::vector::{dot, quantile_of, sub, widen};
use crate::neighbors::{Blocks, MOST_ROWS, comparable, mutual};
use crate::recover::{Confidence, Estimate, Recovered, Status};
use crate::released::{Obfuscation, Released};
use crate::{About, Error, RowOrder};
use meet::{Line, Meet, Near, trust};

/// Points of the first release, recovered with the second one.
#[derive(Clone, Debug)]
pub struct Solved {
    /// Positions with their confidence.
    pub recovered: Recovered<3>,
    /// Record of the second release that is linked to each row of `recovered`.
    pub links: Vec<Option<u32>>,
    /// Number of links whose records leave a line or more, so that the point is not fixed.
    pub n_open: usize,
}

/// Rounding to `f32`, twice, as a share of the largest coordinates.
const ROUNDING: f64 = 2.4e-7;

/// The records of a release in the frame of the first one.
#[derive(Default)]
struct Flats {
    /// Lines of all records, `per_record` each; three for a point with a swapped coordinate, none for a plane.
    lines: Vec<Line>,
    per_record: usize,
    /// Axis and coordinate of each plane.
    planes: Vec<(usize, f64)>,
    swapped: Vec<[f64; 3]>,
    /// The origin of the release in this frame.
    shift: [f64; 3],
}

impl Flats {
    fn new(released: &Released<3>, origin: &[f64; 3]) -> Self {
        let shift = sub(&released.origin(), origin);
        let moved = |p: &[f32; 3]| [0, 1, 2].map(|c| f64::from(p[c]) + shift[c]);
        let records = released.obfuscation();
        let is_ray = matches!(records, Obfuscation::Rays(_));
        let line = |(p, d): (&[f32; 3], &[f32; 3])| {
            let d = widen(d);
            Line { point: moved(p), direction: d.map(|x| x / dot(&d, &d).sqrt()), is_ray }
        };
        let empty = Self { shift, ..Self::default() };
        match records {
            Obfuscation::Lines(_) | Obfuscation::Rays(_) => {
                let lines = (0..records.len()).filter_map(|record| records.line(record));
                Self { lines: lines.map(line).collect(), per_record: 1, ..empty }
            }
            Obfuscation::AxisPlanes(of) => {
                let rows = of.axis().iter().zip(of.offset());
                let plane = |(&axis, &offset): (&u8, &f32)| {
                    (usize::from(axis), f64::from(offset) + shift[usize::from(axis)])
                };
                Self { planes: rows.map(plane).collect(), ..empty }
            }
            Obfuscation::AxisCandidates(of) => {
                let swapped: Vec<[f64; 3]> = of.position().iter().map(moved).collect();
                let axes = |&point: &[f64; 3]| {
                    let along = |axis| [0, 1, 2].map(|c| if c == axis { 1.0 } else { 0.0 });
                    [0, 1, 2].map(|axis| Line { point, direction: along(axis), is_ray })
                };
                let lines = swapped.iter().flat_map(axes).collect();
                Self { lines, per_record: 3, swapped, ..empty }
            }
        }
    }

    /// Returns the size that few swapped coordinates exceed.
    fn size(&self) -> f64 {
        quantile_of(self.swapped.as_flattened().iter().map(|x| x.abs()), 0.99)
    }

    fn of(&self, record: usize) -> &[Line] {
        &self.lines[record * self.per_record..(record + 1) * self.per_record]
    }
}

/// The place that two linked records leave to a point.
#[derive(Clone, Copy, Debug)]
struct Place {
    point: Option<[f64; 3]>,
    /// Distance between the two records; `None` if all such records meet.
    miss: Option<f64>,
    /// Error of the point along its record, if the records are off by one.
    condition: f64,
    axis: u8,
    /// Whether the records leave more than one point.
    is_open: bool,
    /// Whether both records can be of one point.
    is_linked: bool,
    /// Probability that the choice among several points is right.
    chosen: f64,
}

impl Place {
    const NONE: Self = Self {
        point: None,
        miss: None,
        condition: 1.0,
        axis: 0,
        is_open: true,
        is_linked: true,
        chosen: 1.0,
    };

    fn at(point: [f64; 3], axis: usize) -> Self {
        Self { point: Some(point), axis: axis as u8, is_open: false, ..Self::NONE }
    }

    fn of(meet: &Meet, axis: usize) -> Self {
        Self { miss: Some(meet.miss), condition: 1.0 / meet.sine, ..Self::at(meet.point, axis) }
    }

    /// A guess on the line that the records leave.
    fn guess(point: [f64; 3], axis: usize) -> Self {
        Self { is_open: true, chosen: 0.0, ..Self::at(point, axis) }
    }
}

/// Recovers the points of `a` with links by descriptors: mutual nearest neighbors whose records meet.
///
/// # Errors
/// When a release has no descriptors, or the two differ in the unit or the length of descriptors, or have too many points.
pub fn by_descriptors(a: &Released<3>, b: &Released<3>) -> Result<Solved, Error> {
    check(a, b)?;
    let none =
        |which: &str| Error::new(format!("descriptors of the {which} release"), "some", "none");
    let of_a = a.descriptors().ok_or_else(|| none("first"))?;
    let of_b = b.descriptors().ok_or_else(|| none("second"))?;
    let rule = " columns, as in the first release";
    Error::check_len("descriptors", of_b.dim(), of_a.dim(), rule)?;
    let both: Vec<Blocks> = comparable(&[of_a, of_b]).iter().map(|of| Blocks::new(of)).collect();
    let pairs = mutual(&both[0], &both[1]);
    let per_record = [a, b].map(Released::slots_per_record);
    let records: Vec<(usize, usize)> = pairs
        .iter()
        .map(|&(row, other, _)| (row as usize / per_record[0], other as usize / per_record[1]))
        .collect();
    let flats = [a, b].map(|released| Flats::new(released, &a.origin()));
    let places = places(&flats, &records);
    // The distance between records that do not belong together, from links shifted by one.
    let shifted: Vec<f64> = (0..records.len())
        .filter_map(|at| {
            let other = records[(at + 1) % records.len()].1;
            meet::nearest(flats[0].of(records[at].0), flats[1].of(other)).map(|(_, meet)| meet.miss)
        })
        .collect();
    let usual = shifted.iter().sum::<f64>() / shifted.len().max(1) as f64;
    let usual = usual.max(f64::MIN_POSITIVE);
    let linked = places.into_iter().zip(&records).zip(&pairs);
    let linked = linked.map(|((place, &(_, partner)), &(row, _, ratio))| Linked {
        row: row as usize,
        partner: partner as u32,
        place,
        unusual: place.miss.map(|miss| miss / usual),
        by_descriptor: 0.99 * f64::from(1.0 - ratio.min(1.0)),
    });
    solved(a, &linked.collect::<Vec<_>>(), usual, RowOrder::DescriptorRows)
}

/// Recovers the points of `a` from records alone: of two lines that meet within rounding, one belongs to the other.
///
/// # Errors
/// When a release has planes, which meet all records, both have swapped coordinates, which all agree in one coordinate with others,
/// the two differ in the unit, or have too many points.
pub fn by_geometry(a: &Released<3>, b: &Released<3>) -> Result<Solved, Error> {
    check(a, b)?;
    let flats = [a, b].map(|released| Flats::new(released, &a.origin()));
    if flats.iter().any(|of| of.lines.is_empty()) {
        let expected = "descriptors, because a plane meets every record";
        return Err(Error::new("links by geometry", expected, "none used"));
    }
    if flats.iter().all(|of| !of.swapped.is_empty()) {
        let expected = "descriptors, because every value of a coordinate is in both releases";
        return Err(Error::new("links by geometry", expected, "none used"));
    }
    let [of_a, of_b] = &flats;
    let slots = [a, b].map(Released::slots_per_record);
    let near_a = meet::search(&of_a.lines, of_a.per_record, &of_b.lines);
    let near_b = meet::search(&of_b.lines, of_b.per_record, &of_a.lines);
    let mut linked = Vec::new();
    for (record, near) in near_a.iter().enumerate() {
        // The farthest ones are not of this point, so their distance is the usual one.
        let usual = near.last().map_or(1.0, |last| last.miss / near.len() as f64);
        let usual = usual.max(f64::MIN_POSITIVE);
        for (slot, &Near { miss, own, other, .. }) in near.iter().take(slots[0]).enumerate() {
            let partner = other as usize / of_b.per_record;
            let is_own = |back: &Near| back.other as usize / of_a.per_record == record;
            if !near_b[partner].iter().take(slots[1]).any(is_own) {
                continue;
            }
            let Some(meet) = of_a.lines[own as usize].meet(&of_b.lines[other as usize]) else {
                continue;
            };
            let (row, partner) = (record * slots[0] + slot, partner as u32);
            let place = Place::of(&meet, own as usize % of_a.per_record);
            let unusual = Some(miss / usual);
            linked.push(Linked { row, partner, place, unusual, by_descriptor: 0.0 });
        }
    }
    let all = near_a.iter().filter_map(|near| near.last()).map(|last| last.miss);
    let usual = all.sum::<f64>() / (near_a.len().max(1) * meet::KEPT) as f64;
    solved(a, &linked, usual, RowOrder::Either)
}

fn check(a: &Released<3>, b: &Released<3>) -> Result<(), Error> {
    if a.unit() != b.unit() {
        let expected = format!("{}, as in the first release", a.unit().name());
        return Err(Error::new("unit of the second release", expected, b.unit().name()));
    }
    match [a, b].map(Released::n_slots).into_iter().find(|&n| n > MOST_ROWS) {
        Some(n) => Err(Error::new("points", format!("at most {MOST_ROWS}"), n)),
        None => Ok(()),
    }
}

struct Linked {
    row: usize,
    partner: u32,
    place: Place,
    /// Distance between the records in units of the usual one of wrong pairs; `None` if all such records meet.
    unusual: Option<f64>,
    by_descriptor: f64,
}

/// Places the points of linked records.
fn places([a, b]: &[Flats; 2], records: &[(usize, usize)]) -> Vec<Place> {
    // Releases with the same origin store equal coordinates in equal bytes.
    let rounding = if b.shift == [0.0; 3] { 0.0 } else { ROUNDING * a.size().max(b.size()) };
    if !a.swapped.is_empty() && !b.swapped.is_empty() {
        return swaps::solve(&a.swapped, &b.swapped, records, rounding);
    }
    let middle = [0, 1, 2].map(|axis| {
        let of_axis = a.planes.iter().chain(&b.planes).filter(|plane| plane.0 == axis);
        quantile_of(of_axis.map(|plane| plane.1), 0.5)
    });
    let same = same_coordinate(a, b, records).max(rounding);
    let on_plane = |&(axis, at): &(usize, f64), of: &Flats, record: usize| {
        match of.swapped.get(record) {
            // If the coordinates agree, one of the other two is wrong.
            Some(p) if (p[axis] - at).abs() <= same => Place::guess(*p, (axis + 1) % 3),
            Some(p) => {
                let mut point = *p;
                point[axis] = at;
                Place::at(point, axis)
            }
            None => of.of(record)[0].cross(axis, at).map_or(Place::NONE, |(point, condition)| {
                Place { condition, ..Place::at(point, 0) }
            }),
        }
    };
    let place = |&(own, other): &(usize, usize)| match (a.planes.get(own), b.planes.get(other)) {
        (None, None) => {
            // The only line of a record, or one along each axis.
            let nearest = meet::nearest(a.of(own), b.of(other));
            nearest.map_or(Place::NONE, |(line, meet)| Place::of(&meet, line))
        }
        (Some(plane), None) => on_plane(plane, b, other),
        (None, Some(plane)) => on_plane(plane, a, own),
        (Some(&(axis, at)), Some(&(other_axis, other_at))) => {
            let mut point = middle;
            point[other_axis] = other_at;
            point[axis] = at;
            Place::guess(point, 0)
        }
    };
    records.iter().map(place).collect()
}

/// Returns the largest difference between a plane and a point that still has its coordinate; two thirds have it.
fn same_coordinate(a: &Flats, b: &Flats, records: &[(usize, usize)]) -> f64 {
    let difference = |&(own, other): &(usize, usize)| {
        let (plane, point) = match a.planes.get(own) {
            Some(plane) => (plane, b.swapped.get(other)?),
            None => (b.planes.get(other)?, a.swapped.get(own)?),
        };
        Some((point[plane.0] - plane.1).abs())
    };
    10.0 * quantile_of(records.iter().filter_map(difference), 0.33)
}

/// Judges all links together. `usual` is the length of a distance of 1.
fn solved(
    a: &Released<3>,
    linked: &[Linked],
    usual: f64,
    order: RowOrder,
) -> Result<Solved, Error> {
    let unusual: Vec<f64> = linked.iter().filter_map(|link| link.unusual).collect();
    let (trusts, noise) = trust(&unusual);
    let mut trusts = trusts.into_iter();
    let origin = a.origin();
    let sizes = linked.iter().filter_map(|link| link.place.point);
    let rounding = ROUNDING * quantile_of(sizes.map(|p| dot(&p, &p).sqrt()), 0.9);
    let noise = (noise * usual).max(rounding);
    let with_axis = matches!(a.obfuscation(), Obfuscation::AxisCandidates(_));
    let mut estimates = vec![Estimate::lost(Status::TooFewNeighbors); a.n_slots()];
    let mut confidence = vec![Confidence::LOST; a.n_slots()];
    let (mut links, mut n_open) = (vec![None; a.n_slots()], 0);
    for Linked { row, partner, place, unusual, by_descriptor } in linked {
        let found = unusual.and_then(|_| trusts.next()).unwrap_or(*by_descriptor);
        if place.is_linked && (unusual.is_none() || found >= 0.5) {
            links[*row] = Some(*partner);
            n_open += usize::from(place.is_open);
        }
        let position = place.point.map(|point| point.map(|x| x as f32));
        match position.filter(|position| position.iter().all(|x| x.is_finite())) {
            Some(position) => {
                let axis = if with_axis { place.axis } else { 0 };
                estimates[*row] = Estimate::at(position, 2, axis.into(), 0.0);
                let scale = (noise * place.condition) as f32;
                confidence[*row] = Confidence { found: (found * place.chosen) as f32, scale };
            }
            None => estimates[*row] = Estimate::lost(Status::Degenerate),
        }
    }
    let about = About { map: Some(a.fingerprint()), order, ..About::default() };
    let recovered = Recovered::try_new(&estimates, with_axis, None, origin, a.unit(), noise)?;
    let recovered = recovered.with_about(about).with_confidence(confidence)?;
    Ok(Solved { recovered, links, n_open })
}
