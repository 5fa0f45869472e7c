//! The result of all readers of maps, and poses of cameras.

use std::path::PathBuf;

use unlift::geometry::camera::Pose;

/// A map as it was read, in the units of its file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Input {
    /// Points `(n, 3)`, all finite, at least one. COLMAP's are sorted by id, others are in the order of the file.
    pub positions: Vec<[f64; 3]>,
    /// Ids `(n,)`, ascending: those of COLMAP, else rows of the file, counted from 0.
    pub ids: Vec<u64>,
    /// Rows of points that are left out because a coordinate is not finite, among all points in the order of `positions`.
    pub left_out: Vec<u64>,
    /// Camera centers `(m, 3)`. Empty if the format has none.
    pub cameras: Vec<[f64; 3]>,
    /// The number of cameras that are left out because they have no finite pose.
    pub n_unplaced: usize,
    /// The mean up direction of the photos, of unit length. `None` without cameras.
    pub up: Option<[f64; 3]>,
    /// All files that were read, for hashes in a report.
    pub files: Vec<PathBuf>,
    /// The format, as shown to users: `COLMAP binary`, `ply ascii`.
    pub format: &'static str,
    /// Notes for readers of the results, one line each.
    pub notes: Vec<String>,
    /// Reasons why results may be wrong. No gate holds with one.
    pub doubts: Vec<String>,
    /// The folder of the COLMAP model, if the input is one.
    pub model: Option<PathBuf>,
    /// Files beside a COLMAP model that may have its descriptors: a database, then hloc's features.
    pub beside: Vec<PathBuf>,
}

/// The largest share of points without finite coordinates that is a note instead of a doubt.
const MOST_LEFT_OUT: f64 = 0.05;
/// The smallest number and share of points at one position that make a note.
const MANY: usize = 10;
const MANY_SHARE: f64 = 0.01;

impl Input {
    /// The number of points in the file, including those left out.
    pub fn n_rows(&self) -> usize {
        self.positions.len() + self.left_out.len()
    }

    /// Adds a camera: its center and the direction that points up in its photo, or `None` without a pose.
    pub(crate) fn camera(&mut self, pose: Option<([f64; 3], [f64; 3])>) {
        match pose.filter(|(center, up)| is_finite(center) && is_finite(up)) {
            Some((center, up)) => {
                self.cameras.push(center);
                let sum = self.up.unwrap_or_default();
                self.up = Some(std::array::from_fn(|c| sum[c] + up[c]));
            }
            None => self.n_unplaced += 1,
        }
    }

    /// Leaves out points without finite coordinates, and adds notes and doubts for all formats.
    pub(crate) fn settle(mut self) -> Self {
        let n = self.positions.len();
        if self.ids.is_empty() {
            self.ids = (0..n as u64).collect();
        }
        let rows = (0..).zip(&self.positions);
        self.left_out = rows.filter(|(_, x)| !is_finite(x)).map(|(row, _)| row).collect();
        let mut notes = Vec::new();
        if !self.left_out.is_empty() {
            let mut placed = self.positions.iter().map(is_finite);
            self.ids.retain(|_| placed.next() == Some(true));
            self.positions.retain(is_finite);
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
        notes.append(&mut self.notes);
        self.notes = notes;
        self.up = self.up.and_then(|sum| {
            let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
            (length > 1e-9).then(|| sum.map(|x| x / length))
        });
        self
    }
}

fn is_finite(position: &[f64; 3]) -> bool {
    position.iter().all(|x| x.is_finite())
}

/// Returns the most frequent position and its number of points.
fn most_at_one_place(positions: &[[f64; 3]]) -> Option<(usize, [f64; 3])> {
    // Zeros of either sign are equal.
    let bits = |position: &[f64; 3]| position.map(|x| (x + 0.0).to_bits());
    let mut sorted: Vec<[u64; 3]> = positions.iter().map(bits).collect();
    sorted.sort_unstable();
    let most = sorted.chunk_by(|a, b| a == b).max_by_key(|same| same.len())?;
    Some((most.len(), *positions.iter().find(|position| bits(position) == most[0])?))
}

/// Returns a doubt if `more` points follow the `n` declared ones.
pub(crate) fn undeclared(n: u64, more: u64) -> Option<String> {
    (more > 0).then(|| {
        format!("{n} points are declared, and {more} more seem to follow, which are not read: results are about a part of the map")
    })
}

/// Returns the center `-R^T t` of a camera with the pose `x_cam = R x + t`.
pub fn center(rotation: &[[f64; 3]; 3], translation: &[f64; 3]) -> [f64; 3] {
    let along = |c: usize| (0..3).map(|row| rotation[row][c] * translation[row]).sum::<f64>();
    std::array::from_fn(|c| -along(c))
}

/// Returns the pose `x_cam = R x + t`, given as a quaternion (w, x, y, z) and `t`. Not finite for a zero quaternion.
pub(super) fn pose_of([w, x, y, z]: [f64; 4], t: [f64; 3]) -> Pose {
    // The rotation times the squared norm, by which it is divided because files contain norms such as 0.9999999.
    let r = [
        [w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ];
    let norm2 = w * w + x * x + y * y + z * z;
    let center = center(&r, &t).map(|x| x / norm2);
    Pose { rotation: r.map(|row| row.map(|x| x / norm2)), center }
}
