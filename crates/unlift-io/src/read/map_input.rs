//! What any reader gives back: points, cameras, and what must be known of them.

use std::path::PathBuf;

use crate::seen::Seen;

/// A map as it was read, in the units of its file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Input {
    /// Points `(n, 3)`, all finite, at least one. COLMAP's are in ascending order of their ids,
    /// others in the order of the file.
    pub positions: Vec<[f64; 3]>,
    /// Ids `(n,)`, ascending: those of COLMAP's points, else the row in the file, from 0.
    pub ids: Vec<u64>,
    /// Rows of points that are left out as they have no place: a coordinate is not finite. Ascending, among all points
    /// in the order of `positions`.
    pub left_out: Vec<u64>,
    /// Camera centers `(m, 3)`; empty when the format has none.
    pub cameras: Vec<[f64; 3]>,
    /// Cameras that are left out as they have no place.
    pub n_unplaced: usize,
    /// The mean of what is up in the photos, of unit length: up in the world, as people hold cameras;
    /// `None` without cameras.
    pub up: Option<[f64; 3]>,
    /// Every file that was read, for hashes in a report.
    pub files: Vec<PathBuf>,
    /// Size and time of these files before they were read, to see whether one changes meanwhile. Files that are named in
    /// another file are not among them.
    pub seen: Seen,
    /// The name of the format, for people: `COLMAP binary`, `ply ascii`.
    pub format: &'static str,
    /// What was found but not used, and what else whoever reads figures must know, one line each.
    pub notes: Vec<String>,
    /// Why figures may be wrong: no gate holds on them.
    pub doubts: Vec<String>,
    /// Coordinates are degrees of longitude and latitude, which are no lengths, as the file says.
    pub is_geographic: bool,
    /// The folder of the COLMAP model, when the input is one: descriptors are found through its tracks.
    pub model: Option<PathBuf>,
    /// The COLMAP database of the project, if there is one where such projects have it.
    pub database: Option<PathBuf>,
}

/// The largest share of points without a place with which a map is still taken for whole.
const MOST_LEFT_OUT: f64 = 0.05;
/// Points at one place that are told: so many, and at least this share.
const MANY: usize = 10;
const MANY_SHARE: f64 = 0.01;

impl Input {
    /// How many points its files have, with those that are left out.
    pub fn n_rows(&self) -> usize {
        self.positions.len() + self.left_out.len()
    }

    /// Adds a camera: its center and what is up in its photo; `None` if it was not placed.
    pub(crate) fn camera(&mut self, pose: Option<([f64; 3], [f64; 3])>) {
        let is_finite = |x: &[f64; 3]| x.iter().all(|x| x.is_finite());
        match pose.filter(|(center, up)| is_finite(center) && is_finite(up)) {
            Some((center, up)) => {
                self.cameras.push(center);
                let sum = self.up.unwrap_or_default();
                self.up = Some(std::array::from_fn(|c| sum[c] + up[c]));
            }
            None => self.n_unplaced += 1,
        }
    }

    /// What holds for all formats: points without a place are left out, and counted.
    pub(crate) fn settle(mut self) -> Self {
        let n = self.positions.len();
        if self.ids.is_empty() {
            self.ids = (0..n as u64).collect();
        }
        let is_left = |row: &usize| self.positions[*row].iter().any(|x| !x.is_finite());
        self.left_out = (0..n).filter(is_left).map(|row| row as u64).collect();
        let mut notes = Vec::new();
        if !self.left_out.is_empty() {
            let mut left_out = self.left_out.iter().copied().peekable();
            let mut row = 0..;
            self.ids.retain(|_| left_out.next_if_eq(&row.next().unwrap_or(0)).is_none());
            self.positions.retain(|position| position.iter().all(|x| x.is_finite()));
            let note = format!("{} of {n} points have no place", self.left_out.len());
            if self.left_out.len() as f64 > MOST_LEFT_OUT * n as f64 {
                self.doubts.push(format!("{note}: what is audited is not the whole map"));
            } else {
                notes.push(note);
            }
        }
        if self.n_unplaced > 0 {
            let n = self.n_unplaced + self.cameras.len();
            notes.push(format!("{} of {n} cameras have no place", self.n_unplaced));
        }
        if let Some((n, place)) = most_at_one_place(&self.positions)
            && n >= MANY
            && n as f64 >= MANY_SHARE * self.positions.len() as f64
        {
            let of = self.positions.len();
            notes.push(format!("{n} of {of} points are at exactly one place, {place:?}"));
        }
        if self.is_geographic {
            self.doubts.push(
                "coordinates are degrees, which are no lengths: project them first".to_owned(),
            );
        }
        notes.append(&mut self.notes);
        self.notes = notes;
        self.up = self.up.and_then(|sum| {
            let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
            (length > 1e-9).then(|| sum.map(|x| x / length))
        });
        self
    }
}

/// The place at which most points are, and how many.
pub(crate) fn most_at_one_place(positions: &[[f64; 3]]) -> Option<(usize, [f64; 3])> {
    // Zeros of either sign are the same place.
    let bits = |position: &[f64; 3]| position.map(|x| (x + 0.0).to_bits());
    let mix = |[x, y, z]: [u64; 3]| {
        let step = |hash: u64, bits: u64| (hash ^ bits).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let hash = step(step(step(0, x).rotate_left(23), y).rotate_left(23), z);
        hash ^ hash >> 29
    };
    let mut hashes: Vec<u64> = positions.iter().map(|position| mix(bits(position))).collect();
    hashes.sort_unstable();
    let most = hashes.chunk_by(|a, b| a == b).max_by_key(|same| same.len())?[0];
    let place = *positions.iter().find(|position| mix(bits(position)) == most)?;
    // By the bits: two places may have one hash.
    let n = positions.iter().filter(|position| bits(position) == bits(&place)).count();
    Some((n, place))
}
