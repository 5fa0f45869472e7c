//! Triangulation of a point from the records of several views, one record per view.
//!
//! Lines of images back-project to planes, of which three meet in a point. Axis candidates are two lines, so that a fourth view decides.

use crate::geometry::frame::Bounds;
use crate::geometry::vector::{cross, distance, dot};

/// A plane `n . x + d = 0`, scaled such that `(n . x + d) / depth` is the distance of the projection of `x` from a line, in pixels.
type Plane = [f64; 4];

/// A record of one view, as constraints on the point in space.
#[derive(Clone, Debug)]
pub struct Sight {
    /// Projection matrix `K [R | t]`: homogeneous pixels; the last row gives the depth.
    projection: [[f64; 4]; 3],
    /// Pixel coordinates at which the keypoint can be.
    area: Bounds<2>,
    /// Back-projected lines, of which one contains the keypoint; the second is unused for most records.
    planes: [Plane; 2],
    normals: [[f64; 2]; 2],
    n_planes: usize,
}

impl Sight {
    /// Back-projects one or two lines `[a, b, c]` with `a u + b v + c = 0` and unit `(a, b)`, of which one contains the keypoint.
    pub fn new(projection: [[f64; 4]; 3], area: Bounds<2>, lines: &[[f64; 3]]) -> Self {
        let (mut planes, mut normals) = ([[0.0; 4]; 2], [[0.0; 2]; 2]);
        for (at, line) in lines.iter().enumerate() {
            let column = |c: usize| (0..3).map(|row| line[row] * projection[row][c]).sum();
            planes[at] = std::array::from_fn(column);
            normals[at] = [line[0], line[1]];
        }
        Self { projection, area, planes, normals, n_planes: lines.len() }
    }

    /// Projects a point in front of the camera, into the area of the keypoint or at most `margin` pixels beside it.
    fn project(&self, x: &[f64; 3], margin: f64) -> Option<([f64; 2], f64)> {
        let [u, v, depth] = self.projection.map(|row| affine(&row, x));
        let place = [u / depth, v / depth];
        let Bounds { low, high } = &self.area;
        let inside = |c: usize| place[c] >= low[c] - margin && place[c] <= high[c] + margin;
        (depth > 0.0 && inside(0) && inside(1)).then_some((place, depth))
    }

    /// Returns the line nearest to the projection of `x`, and its signed distance in pixels.
    fn nearest(&self, x: &[f64; 3], depth: f64) -> (usize, f64) {
        let first = affine(&self.planes[0], x) / depth;
        if self.n_planes < 2 {
            return (0, first);
        }
        let second = affine(&self.planes[1], x) / depth;
        if second.abs() < first.abs() { (1, second) } else { (0, first) }
    }
}

#[inline(always)]
fn affine(row: &[f64; 4], x: &[f64; 3]) -> f64 {
    row[0] * x[0] + row[1] * x[1] + row[2] * x[2] + row[3]
}

/// A triangulated point, as seen by the first view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Its projection into the first view, on the line of the record.
    pub place: [f64; 2],
    /// Which of the record's lines contains the keypoint.
    pub line: usize,
    /// Number of views that agree with the point, with the first one.
    pub n_agree: usize,
    /// Root mean square distance of its projections from the lines of these views, in pixels.
    pub residual_px: f64,
    /// Standard deviation of `place` along its line, in pixels, if all lines are off by one pixel; infinite where planes fix no point.
    pub condition: f64,
    /// Lead over the best solution at another place, as a difference of squared residuals in units of the noise. Infinite without one.
    pub lead: f64,
}

/// Most hypotheses of three records.
pub(super) const MOST_HYPOTHESES: usize = 240;
const REFINED: usize = 5;
const STEPS: usize = 8;
/// Distance that counts as a miss, in units of the noise.
pub(super) const MISS: f64 = 3.0;
/// Two solutions are at different places if they are farther apart in the first view than this, in units of the noise.
const APART: f64 = 5.0;

/// Finds the point that most of `sights` agree on, the first among them; `noise_px` is their usual error. Returns `None` with fewer than
/// three records, or if no point is in front of the cameras and inside of the images.
pub fn triangulate(sights: &[Sight], noise_px: f64) -> Option<Fit> {
    let (first, others) = sights.split_first()?;
    // Pairs of other views in the order of their sum, so that early ones are used evenly.
    let n = others.len();
    let pairs = (1..(2 * n).saturating_sub(2)).flat_map(|sum| {
        let from = (sum + 1).saturating_sub(n);
        (from..sum.div_ceil(2)).map(move |a| (a, sum - a))
    });
    let mut tried: Vec<(f64, [f64; 3])> = Vec::new();
    'all: for (a, b) in pairs {
        let (a, b) = (&others[a], &others[b]);
        for i in 0..first.n_planes {
            for j in 0..a.n_planes {
                for k in 0..b.n_planes {
                    if tried.len() == MOST_HYPOTHESES {
                        break 'all;
                    }
                    let met = meet(&first.planes[i], &a.planes[j], &b.planes[k]);
                    let Some(x) = met else { continue };
                    let margin = MISS * noise_px;
                    if [first, a, b].iter().all(|sight| sight.project(&x, margin).is_some()) {
                        tried.push((cost(sights, &x, 2.0 * noise_px), x));
                    }
                }
            }
        }
    }
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut fits: Vec<(f64, Fit)> = Vec::new();
    for (_, x) in &tried {
        if fits.len() == REFINED {
            break;
        }
        let Some((place, _)) = first.project(x, f64::INFINITY) else { continue };
        // Hypotheses near a refined one would end there.
        let near = |(_, fit): &(f64, Fit)| distance(&fit.place, &place) < 0.5 * APART * noise_px;
        if fits.iter().any(near) {
            continue;
        }
        fits.extend(refine(sights, *x, noise_px));
    }
    let &(least, mut fit) = fits.iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    let others =
        fits.iter().filter(|(_, other)| distance(&other.place, &fit.place) > APART * noise_px);
    fit.lead = others.map(|(cost, _)| cost - least).fold(f64::INFINITY, f64::min);
    Some(fit)
}

/// Sum of squared distances in units of `noise_px`; a view that disagrees counts as a miss.
fn cost(sights: &[Sight], x: &[f64; 3], noise_px: f64) -> f64 {
    let margin = MISS * noise_px;
    let of = |sight: &Sight| match sight.project(x, margin) {
        Some((_, depth)) => {
            let r = sight.nearest(x, depth).1 / noise_px;
            (r * r).min(MISS * MISS)
        }
        None => MISS * MISS,
    };
    sights.iter().map(of).sum()
}

fn meet(a: &Plane, b: &Plane, c: &Plane) -> Option<[f64; 3]> {
    let normal = |p: &Plane| [p[0], p[1], p[2]];
    solve([normal(a), normal(b), normal(c)], [-a[3], -b[3], -c[3]])
}

/// Solves `rows x = right`; `None` if the rows are nearly dependent.
fn solve(rows: [[f64; 3]; 3], right: [f64; 3]) -> Option<[f64; 3]> {
    let [a, b, c] = &rows;
    let (bc, ca, ab) = (cross(b, c), cross(c, a), cross(a, b));
    let det = dot(a, &bc);
    let size = [a, b, c].map(|row| dot(row, row).sqrt()).iter().product::<f64>();
    if det.is_nan() || det.abs() <= 1e-12 * size {
        return None;
    }
    Some(std::array::from_fn(|i| (right[0] * bc[i] + right[1] * ca[i] + right[2] * ab[i]) / det))
}

/// Least squares in pixels with weights that fall with the distance, from `x`. Returns the cost and the fit.
fn refine(sights: &[Sight], mut x: [f64; 3], noise_px: f64) -> Option<(f64, Fit)> {
    let first = &sights[0];
    let margin = MISS * noise_px;
    for step in 0..STEPS {
        let (mut normal, mut right) = ([[0.0; 3]; 3], [0.0; 3]);
        // The tolerance shrinks, because the start has the error of three lines.
        let tolerance = noise_px * if step < 3 { 2.0 } else { 1.0 };
        for sight in sights {
            let Some((_, depth)) = sight.project(&x, 2.0 * margin) else { continue };
            let (at, r) = sight.nearest(&x, depth);
            let ratio = r / tolerance;
            if ratio.abs() > 2.0 * MISS {
                continue;
            }
            let weight = 1.0 / (1.0 + ratio * ratio) / (depth * depth);
            add(&mut normal, &sight.planes[at], weight);
            let plane = &sight.planes[at];
            for (right, normal) in right.iter_mut().zip(plane) {
                *right -= weight * normal * affine(plane, &x);
            }
        }
        // The step, slightly damped: three planes may be nearly dependent.
        let trace = normal[0][0] + normal[1][1] + normal[2][2];
        (0..3).for_each(|c| normal[c][c] += 1e-9 * trace);
        let Some(moved) = solve(normal, right) else { break };
        (0..3).for_each(|c| x[c] += moved[c]);
    }
    let (place, depth) = first.project(&x, margin)?;
    let (line, own) = first.nearest(&x, depth);
    let (mut n_agree, mut squares, mut normal) = (0, 0.0, [[0.0; 3]; 3]);
    for sight in sights {
        let Some((_, depth)) = sight.project(&x, margin) else { continue };
        let (at, r) = sight.nearest(&x, depth);
        if r.abs() <= margin {
            n_agree += 1;
            squares += r * r;
            add(&mut normal, &sight.planes[at], 1.0 / (depth * depth));
        }
    }
    // The derivative of the place along its line.
    let [a, b] = first.normals[line];
    let [u, v, w] = first.projection;
    let along: [f64; 3] = std::array::from_fn(|c| {
        (-b * (u[c] - place[0] * w[c]) + a * (v[c] - place[1] * w[c])) / depth
    });
    let variance = solve(normal, along).map_or(f64::INFINITY, |by| dot(&along, &by));
    let fit = Fit {
        place: [place[0] - own * a, place[1] - own * b],
        line,
        n_agree,
        residual_px: (squares / n_agree.max(1) as f64).sqrt(),
        condition: if variance >= 0.0 { variance.sqrt() } else { f64::INFINITY },
        lead: f64::INFINITY,
    };
    Some((cost(sights, &x, noise_px), fit))
}

fn add(normal: &mut [[f64; 3]; 3], plane: &Plane, weight: f64) {
    for r in 0..3 {
        for c in 0..3 {
            normal[r][c] += weight * plane[r] * plane[c];
        }
    }
}
