//! Maps: read from files, and their points selected and scaled for an audit.

pub mod released;
pub(crate) mod shapes;

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use unlift::audit::PointNeighbors;
use unlift::audit::doubts::of_descriptors;
use unlift::geometry::knn::Knn;
use unlift::geometry::vector::{distance, median};
use unlift::seed::{Draws, Stage};
use unlift::truth::Original;
use unlift::{Descriptors, Error, ErrorKind, PointSet, Unit};
use unlift_io::hash::{hash_file, hash_files};
use unlift_io::read::{self, Cameras};
use unlift_io::stage::read_point_neighborhoods;
use unlift_report::document::Input;

use crate::bail;
use crate::doubts::{Remarks, check_scale, with_sides};

/// Options for the points of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preparation {
    /// Meters per unit of the file. Without it, the median distance to the K-th neighbor is the unit.
    pub scale: Option<f64>,
    /// The K of that unit.
    pub k: usize,
    /// Size of the random subset.
    pub max_points: Option<usize>,
    /// Whether the last of an odd number of points is left out, so that schemes that pair points hide the same ones as all others.
    pub even: bool,
    /// Whether descriptors that lie beside a COLMAP model are read if no file of them is given.
    pub beside: bool,
    /// Seed of the subset.
    pub seed: u64,
}

/// K of a default audit of a map.
pub(crate) const USUAL_K: usize = 50;

/// All points, in the unit of the median distance to the 50th neighbor.
impl Default for Preparation {
    fn default() -> Self {
        Self { scale: None, k: USUAL_K, max_points: None, even: false, beside: false, seed: 0 }
    }
}

/// Points ready for an audit.
#[derive(Debug)]
pub struct Prepared {
    /// The points in the unit of the audit.
    pub original: Arc<Original<3>>,
    /// Descriptors, one row per point.
    pub descriptors: Option<Descriptors>,
    /// The file that the descriptors were read from.
    pub descriptors_file: Option<PathBuf>,
    /// Length of the unit of the audit in units of the file.
    pub unit_in_map_units: f64,
    /// Rows of the file that were kept, ascending.
    pub rows: Vec<u32>,
    /// The cameras that observe the points, if the file has them.
    pub cameras: Cameras,
    /// Notes and doubts about the points, and about what was read with them.
    pub remarks: Remarks,
    /// The map as it was read; empty for points in memory.
    pub input: read::Input,
}

impl Prepared {
    /// Takes points that are in the unit of the audit, without descriptors and cameras.
    pub fn of(original: Original<3>) -> Self {
        let rows = (0..original.len() as u32).collect();
        let (descriptors, descriptors_file, cameras, remarks, input) = Default::default();
        Self {
            original: Arc::new(original),
            descriptors,
            descriptors_file,
            unit_in_map_units: 1.0,
            rows,
            cameras,
            remarks,
            input,
        }
    }

    /// Checks that the longest side of the map, in meters at this `scale`, is in a range, if one is given.
    pub fn check_extent(
        &self,
        range: Option<(f64, f64)>,
        scale: Option<f64>,
    ) -> Result<(), crate::Error> {
        let Some((low, high)) = range else { return Ok(()) };
        let input = Input { scale_m_per_unit: scale, ..Input::default() };
        let input = with_sides(input, self.original.reveal());
        let is_within =
            |sides: [f64; 3]| (low..=high).contains(&sides.into_iter().fold(0.0, f64::max));
        if input.extent_m.is_some_and(is_within) {
            return Ok(());
        }
        let found = input.extent().unwrap_or("lengths that are not in meters".to_owned());
        bail!("--expect-extent: expected a longest side of {low} to {high} m, found {found}")
    }

    /// Returns what a report says of the map at `path`, with the hashes of its files.
    pub fn about(&self, path: &Path) -> Result<Input, crate::Error> {
        let points = self.original.reveal();
        let descriptors = self.descriptors_file.iter();
        let others = descriptors.map(|file| Ok(("descriptors".to_owned(), hash_file(file)?)));
        Ok(Input {
            path: Some(path.display().to_string()),
            sha256: Some(hash_files(&self.input.files)?),
            n_points: points.len() as u64,
            scale_m_per_unit: (points.unit() == Unit::Meter)
                .then_some(1.0 / self.unit_in_map_units),
            unit_in_map_units: Some(self.unit_in_map_units),
            other_sha256: others.collect::<Result<_, crate::Error>>()?,
            ..Input::default()
        })
    }
}

/// Reads a map and prepares it for an audit; `descriptors` is a separate file of descriptors. The result has notes and doubts about the
/// input.
///
/// # Errors
/// If a file cannot be read, if the scale makes lengths meaningless, or if too few points are left.
pub fn open(
    path: &Path,
    descriptors: Option<&Path>,
    preparation: &Preparation,
) -> Result<Prepared, crate::Error> {
    let input = read::open(path).map_err(|error| {
        let way_out = "the folder of a COLMAP model or project; for photos, unlift audit images";
        let is_other = path.is_dir() && !read::is_project(path);
        let error = crate::Error::from(error);
        if is_other { error.advise(way_out) } else { error }
    })?;
    check_scale(&input.positions, preparation.scale)?;
    let mut remarks = Remarks { notes: input.notes.clone(), doubts: input.doubts.clone() };
    let described = match descriptors {
        Some(file) => Some((read::descriptors(file, &input)?, file.to_owned())),
        None if preparation.beside => beside(&input, &mut remarks),
        None => None,
    };
    let (rows, file) = described.unzip();
    let mut prepared = prepare(&input.positions, rows.as_ref(), preparation).map_err(|error| {
        let few = error.kind() == ErrorKind::TooFewPoints && input.positions.len() > 2;
        let error = crate::Error::from(unlift_io::Error::core(path, error));
        if few { error.advise("a smaller --k, or more points") } else { error }
    })?;
    remarks.notes.append(&mut prepared.remarks.notes);
    remarks.doubts.append(&mut prepared.remarks.doubts);
    // `prepared.rows` counts the points with a place only.
    prepared.rows = rows_of_file(&prepared.rows, &input.left_out);
    if let Some(model) = &input.model {
        match Cameras::read(model, &prepared.rows, 1.0 / prepared.unit_in_map_units) {
            Ok(cameras) => {
                remarks.notes.extend(cameras.note());
                prepared.cameras = cameras;
            }
            // An audit of points needs no cameras.
            Err(error) => remarks.notes.push(format!("localization: not measured: {error}")),
        }
    }
    if let Some(rows) = &prepared.descriptors {
        remarks.notes.extend(zeros(rows));
        remarks.doubts.extend(of_descriptors(prepared.original.reveal(), rows)?);
    }
    Ok(Prepared { remarks, descriptors_file: file, input, ..prepared })
}

/// Reads the first file beside the model of `input` that has the descriptors of its points. Remarks which one has, or why none has.
fn beside(input: &read::Input, remarks: &mut Remarks) -> Option<(Descriptors, PathBuf)> {
    let mut reasons = Vec::new();
    for file in &input.beside {
        match read::descriptors(file, input) {
            Ok(rows) => {
                remarks.notes.push(format!("descriptors: {}, beside the model", file.display()));
                return Some((rows, file.clone()));
            }
            Err(error) => reasons.push(format!("descriptors: {error}")),
        }
    }
    remarks.doubts.extend(reasons);
    None
}

/// Returns `rows` among all points of the file, which may contain points that the reader left out.
fn rows_of_file(rows: &[u32], left_out: &[u64]) -> Vec<u32> {
    let mut left_out = left_out.iter().peekable();
    let mut shift = 0;
    let of_file = |&row: &u32| {
        while left_out.next_if(|&&out| out <= u64::from(row) + shift).is_some() {
            shift += 1;
        }
        row + shift as u32
    };
    rows.iter().map(of_file).collect()
}

/// Returns a note about descriptors that are all zero; some exporters mark missing descriptors like this.
pub fn zeros(descriptors: &Descriptors) -> Option<String> {
    let of = descriptors.len();
    let n = (0..of).filter(|&row| descriptors.is_zero(row)).count();
    let note = format!("{n} of {of} descriptors are all zero and give an attacker no information");
    (n > 0).then_some(note)
}

/// Thins out and scales `positions` and `descriptors`. Owned positions that are all kept
/// are not copied, because large maps need the memory.
///
/// # Errors
/// If fewer than K + 1 points are left, they coincide, or a scaled coordinate is not finite.
pub fn prepare<'a>(
    positions: impl Into<Cow<'a, [[f64; 3]]>>,
    descriptors: Option<&Descriptors>,
    preparation: &Preparation,
) -> Result<Prepared, Error> {
    let positions = positions.into();
    let n_read = positions.len();
    let mut remarks = Remarks::default();
    let mut rows: Vec<u32> = (0..n_read as u32).collect();
    if let Some(max_points) = preparation.max_points
        && rows.len() > max_points
    {
        remarks.doubts.push(format!(
            "--max-points: {max_points} of {n_read} points are audited; the whole map is denser, so more of it is \
             recovered"
        ));
        Draws::new(preparation.seed, Stage::Subset, 0).shuffle(&mut rows);
        rows.truncate(max_points);
        rows.sort_unstable();
    }
    if preparation.even && rows.len() % 2 == 1 && rows.len() > preparation.k + 1 {
        rows.pop();
        remarks.notes.push("1 point is left out, so that schemes that pair points hide the same ones as all others".to_owned());
    }
    let k = preparation.k;
    if rows.len() <= k {
        let expected = format!("at least {} (K + 1)", k.saturating_add(1));
        let error = Error::new("points", expected, rows.len().to_string());
        return Err(error.of_kind(ErrorKind::TooFewPoints));
    }
    let kept: Vec<[f64; 3]> = match rows.len() == n_read {
        true => positions.into_owned(),
        false => rows.iter().map(|&row| positions[row as usize]).collect(),
    };
    let (unit_in_map_units, factor, unit) = match preparation.scale {
        Some(scale) => (1.0 / scale, scale, Unit::Meter),
        None => {
            let distance = median(&mut Knn::new(&kept)?.kth_distances(k));
            if !(distance > 0.0 && (1.0 / distance).is_finite()) {
                let what = format!("median distance to neighbor {k}");
                let expected = "more than 0 (points that do not coincide)";
                return Err(Error::new(what, expected, distance.to_string()));
            }
            (distance, 1.0 / distance, Unit::KthNeighbor)
        }
    };
    let points = PointSet::try_new(kept, unit)?;
    let points = if factor == 1.0 { points } else { points.scaled(factor, unit)? };
    let descriptors = descriptors.map(|all| all.select(&rows));
    let prepared = Prepared::of(Original::new(points));
    Ok(Prepared { descriptors, unit_in_map_units, rows, remarks, ..prepared })
}

/// Reads lists by row of the file and keeps those of the prepared rows.
///
/// Doubts about the lists are added to the notes of the map.
///
/// # Errors
/// If the file cannot be read, or has another number of rows.
pub fn by_point(path: &Path, prepared: &mut Prepared) -> Result<PointNeighbors, crate::Error> {
    let n_read = prepared.input.n_rows().max(prepared.original.len());
    let lists = read_point_neighborhoods(path, n_read)?;
    let mut kept_as = vec![None; n_read];
    for (kept, &row) in prepared.rows.iter().enumerate() {
        kept_as[row as usize] = Some(kept as u32);
    }
    let (mut offsets, mut neighbors) = (vec![0u64], Vec::new());
    let mut scores = lists.scores().map(|_| Vec::new());
    for &row in &prepared.rows {
        for (at, &neighbor) in lists.of(row as usize).iter().enumerate() {
            // Some searches return the point itself, too.
            let other = |&kept: &u32| kept as usize + 1 != offsets.len();
            let Some(kept) = kept_as[neighbor.index()].filter(other) else { continue };
            neighbors.push(kept);
            if let (Some(scores), Some(all)) = (&mut scores, lists.scores_of(row as usize)) {
                scores.push(all[at]);
            }
        }
        offsets.push(neighbors.len() as u64);
    }
    let (notes, doubts) = doubts(&offsets, &neighbors, prepared);
    prepared.remarks.notes.extend(notes);
    prepared.remarks.doubts.extend(doubts);
    // The hashes identify the file; a file called oracle must not appear as the source `oracle`.
    let name = "file".to_owned();
    Ok(PointNeighbors { name, offsets, neighbors, scores })
}

/// Returns notes and doubts about given lists. With lists of another map little is recovered, which would look like protection.
fn doubts(
    offsets: &[u64],
    neighbors: &[u32],
    prepared: &Prepared,
) -> (Option<String>, Option<String>) {
    let points = prepared.original.reveal().positions();
    let (empty, n) = (offsets.windows(2).filter(|w| w[0] == w[1]).count(), points.len());
    let lost = "points have no neighbors in the file";
    let note = (empty > 0).then(|| format!("lists: {empty} of {n} {lost}"));
    let (mut nearer, mut n) = (0usize, 0usize);
    for (point, w) in offsets.windows(2).enumerate() {
        for &neighbor in &neighbors[w[0] as usize..w[1] as usize] {
            // A large odd factor spreads the compared points over the map.
            let stranger = (n * 7919 + 3) % points.len();
            let to = |neighbor: usize| distance(&points[point], &points[neighbor]);
            nearer += usize::from(to(neighbor as usize) < to(stranger));
            n += 1;
        }
    }
    // Of random points half are nearer; two standard deviations are added, and what lists of use are far above.
    let is_random = n > 0 && nearer as f64 <= 0.55 * n as f64 + (n as f64).sqrt();
    let doubt = is_random.then(|| {
        format!(
            "lists: the neighbors in the file are hardly nearer than random points ({nearer} of {n}): check that they are \
             of this map and in its order of rows"
        )
    });
    (note, doubt)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: Preparation =
        Preparation { scale: None, k: 2, max_points: None, even: false, beside: false, seed: 0 };

    /// Points 0.5 apart on a line; the second neighbor is 0.5 away except at the ends.
    fn line(n: usize) -> Vec<[f64; 3]> {
        (0..n).map(|i| [0.5 * i as f64, 0.0, 0.0]).collect()
    }

    #[test]
    fn the_unit_is_the_kth_neighbor_or_with_a_scale_meters() {
        for (scale, in_map_units, unit, third) in
            [(None, 0.5, Unit::KthNeighbor, 3.0), (Some(4.0), 0.25, Unit::Meter, 6.0)]
        {
            let prepared = prepare(line(9), None, &Preparation { scale, ..PLAIN }).unwrap();
            let points = prepared.original.reveal();
            assert_eq!((prepared.unit_in_map_units, points.unit()), (in_map_units, unit));
            assert_eq!(points.positions()[3], [third, 0.0, 0.0]);
            let even = prepare(line(9), None, &Preparation { scale, even: true, ..PLAIN }).unwrap();
            assert_eq!((even.rows, even.remarks.notes.len()), ((0..8).collect(), 1));
            let few = prepare(line(3), None, &Preparation { scale, even: true, ..PLAIN }).unwrap();
            assert_eq!(few.rows.len(), 3, "no fewer than K + 1");
        }
        let coincide = "median distance to neighbor 2: expected more than 0 (points that do not coincide), found 0";
        for (points, expected) in [
            (line(2), "points: expected at least 3 (K + 1), found 2"),
            (vec![[1.0; 3]; 5], coincide),
        ] {
            assert_eq!(prepare(points, None, &PLAIN).unwrap_err().to_string(), expected);
        }
    }

    #[test]
    fn points_that_are_handed_over_are_not_copied() {
        let meters = Preparation { scale: Some(1.0), ..PLAIN };
        let points = line(9);
        let lent = prepare(&points, None, &meters).unwrap();
        let place = points.as_ptr();
        let given = prepare(points, None, &meters).unwrap();
        assert_eq!(given.original.reveal().positions().as_ptr(), place);
        assert_eq!(given.original.reveal(), lent.original.reveal());
    }

    #[test]
    fn lists_that_cannot_be_of_the_map_are_doubted() {
        let n = 200;
        let points = (0..n).map(|i| [0.1 * i as f64, 0.0, 0.0]).collect();
        let points = PointSet::try_new(points, Unit::Meter).unwrap();
        let prepared = Prepared::of(Original::new(points));
        // The next few points; with a factor other than 1, other points.
        let about = |factor: usize, length: usize| {
            let offsets: Vec<u64> = (0..=n).map(|point| (point * length) as u64).collect();
            let row = |point: usize| (1..=length).map(move |step| (point * factor + step) % n);
            let neighbors: Vec<u32> = (0..n).flat_map(row).map(|other| other as u32).collect();
            let (note, doubt) = doubts(&offsets, &neighbors, &prepared);
            note.or(doubt).unwrap_or_default()
        };
        assert_eq!(about(1, 5), "");
        let far = about(77, 5);
        assert!(
            far.starts_with("lists: the neighbors in the file are hardly nearer than"),
            "{far}"
        );
        let empty = "lists: 200 of 200 points have no neighbors in the file";
        assert_eq!(about(1, 0), empty);
    }
}
