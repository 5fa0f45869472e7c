//! Where two records meet, and how far a link is trusted whose records miss each other by a distance.

use crate::geometry::vector::{along, cross, dot, sub};
use crate::parallel;
use crate::simd::{self, Kernel};

/// A line, or a half-line from `point`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    pub point: [f64; 3],
    pub direction: [f64; 3],
    pub is_ray: bool,
}

/// The place where a line is nearest to another one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meet {
    pub point: [f64; 3],
    pub miss: f64,
    pub sine: f64,
}

/// Smallest sine of the angle between lines that fix a point.
const LEAST_SINE: f64 = 1e-5;
/// Centers of rays that are closer, as a share of their distance from the origin, are one: both releases compute them from the points.
const ONE_CENTER: f64 = 1e-4;

impl Line {
    /// Returns where this line is nearest to `other`; `None` if they are nearly parallel, or only meet behind the start of a ray.
    pub fn meet(&self, other: &Self) -> Option<Meet> {
        let normal = cross(&self.direction, &other.direction);
        let sine2 = dot(&normal, &normal);
        if sine2 < LEAST_SINE * LEAST_SINE {
            return None;
        }
        let between = sub(&other.point, &self.point);
        let own = dot(&cross(&between, &other.direction), &normal) / sine2;
        let others = dot(&cross(&between, &self.direction), &normal) / sine2;
        // Rays from one center meet there, whatever they hide.
        let apart2 = dot(&between, &between) / dot(&self.point, &self.point);
        let is_one_center = self.is_ray && other.is_ray && apart2 < ONE_CENTER * ONE_CENTER;
        let is_behind = (self.is_ray && own <= 0.0) || (other.is_ray && others <= 0.0);
        let meets = !is_one_center && !is_behind;
        let point = along(&self.point, own, &self.direction);
        let sine = sine2.sqrt();
        meets.then(|| Meet { point, miss: dot(&between, &normal).abs() / sine, sine })
    }

    /// Returns where this line crosses the plane `x[axis] = at`, and the error along it per error of the plane.
    pub fn cross(&self, axis: usize, at: f64) -> Option<([f64; 3], f64)> {
        let slope = self.direction[axis];
        let t = (at - self.point[axis]) / slope;
        let is_met = slope.abs() > LEAST_SINE && !(self.is_ray && t <= 0.0);
        is_met.then(|| (along(&self.point, t, &self.direction), 1.0 / slope.abs()))
    }
}

/// Returns the line of a record that meets the other record best, and where.
pub(super) fn nearest(own: &[Line], others: &[Line]) -> Option<(usize, Meet)> {
    let pairs =
        own.iter().enumerate().flat_map(|(at, line)| others.iter().map(move |o| (at, line, o)));
    let meets = pairs.filter_map(|(at, line, other)| Some((at, line.meet(other)?)));
    meets.min_by(|a, b| a.1.miss.total_cmp(&b.1.miss))
}

pub(super) const KEPT: usize = 8;
const LANES: usize = 16;

/// A line that passes a record.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    pub miss: f64,
    pub own: u32,
    pub other: u32,
}

/// Returns the [`KEPT`] lines of `others` that pass each record of `per_record` lines most closely, nearest first.
pub(super) fn search(lines: &[Line], per_record: usize, others: &[Line]) -> Vec<Vec<Near>> {
    let columns = columns(others);
    let of_record = |record: usize| {
        let own = &lines[record * per_record..(record + 1) * per_record];
        let mut near: Vec<Near> = Vec::with_capacity(KEPT + 1);
        for (at, line) in own.iter().enumerate() {
            let (line, own) = (*line, (record * per_record + at) as u32);
            simd::dispatch(Pass { line, own, others, columns: &columns, near: &mut near });
        }
        near
    };
    parallel::map(lines.len() / per_record, of_record)
}

fn columns(lines: &[Line]) -> [Vec<f64>; 6] {
    std::array::from_fn(|c| {
        let value = |line: &Line| if c < 3 { line.point[c] } else { line.direction[c - 3] };
        let mut column: Vec<f64> = lines.iter().map(value).collect();
        column.resize(lines.len().next_multiple_of(LANES), f64::NAN);
        column
    })
}

struct Pass<'a> {
    line: Line,
    own: u32,
    others: &'a [Line],
    columns: &'a [Vec<f64>; 6],
    near: &'a mut Vec<Near>,
}

impl Kernel for Pass<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { line, own, others, columns, near } = self;
        let ([px, py, pz], [dx, dy, dz]) = (line.point, line.direction);
        let mut limit2 = limit2(near);
        for first in (0..columns[0].len()).step_by(LANES) {
            let [x, y, z, u, v, w] = std::array::from_fn(|c| &columns[c][first..first + LANES]);
            let mut above = [0.0f64; LANES];
            for l in 0..LANES {
                let (nx, ny, nz) =
                    (dy * w[l] - dz * v[l], dz * u[l] - dx * w[l], dx * v[l] - dy * u[l]);
                let between = (x[l] - px) * nx + (y[l] - py) * ny + (z[l] - pz) * nz;
                above[l] = between * between - limit2 * (nx * nx + ny * ny + nz * nz);
            }
            if !above.iter().any(|&above| above < 0.0) {
                continue;
            }
            for (l, _) in above.iter().enumerate().filter(|(_, above)| **above < 0.0) {
                let other = (first + l) as u32;
                let Some(meet) = line.meet(&others[other as usize]) else { continue };
                let at = near.partition_point(|near| near.miss <= meet.miss);
                near.insert(at, Near { miss: meet.miss, own, other });
                near.truncate(KEPT);
            }
            limit2 = self::limit2(near);
        }
    }
}

/// Returns the squared distance below which a line is kept.
fn limit2(near: &[Near]) -> f64 {
    if near.len() < KEPT { f64::MAX } else { near[KEPT - 1].miss * near[KEPT - 1].miss }
}

const ROUNDS: usize = 50;
const LEAST: f64 = 1e-12;
/// Most noise, as a share of the usual distance, at which right links stand out.
const MOST: f64 = 0.1;

/// Returns the probability of each link and the noise of the right ones. A distance of 1 is usual of wrong links.
///
/// Distances of wrong links are exponential, those of right ones are Cauchy's. Scale and share are learned (expectation maximization).
pub(super) fn trust(distances: &[f64]) -> (Vec<f64>, f64) {
    let mut sorted = distances.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let mut scale = sorted.get(sorted.len() / 10).map_or(LEAST, |first| first.max(LEAST));
    let mut share = 0.5;
    let mut found = vec![0.0; distances.len()];
    for _ in 0..ROUNDS {
        let (mut sum, mut squares) = (0.0, 0.0);
        for (found, &distance) in found.iter_mut().zip(distances) {
            let ratio2 = (distance / scale) * (distance / scale);
            let right = share * std::f64::consts::FRAC_2_PI / scale / (1.0 + ratio2);
            let wrong = (1.0 - share) * libm::exp(-distance);
            *found = right / (right + wrong);
            sum += *found;
            squares += *found * 2.0 * distance * distance / (1.0 + ratio2);
        }
        if sum <= 0.0 {
            break;
        }
        scale = (squares / sum).sqrt().max(LEAST);
        share = (sum / distances.len() as f64).clamp(0.001, 0.999);
    }
    if scale > MOST {
        found.fill(0.0);
    }
    (found, scale)
}
