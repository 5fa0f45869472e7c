//! The layout: positions from the graph of neighbors alone.
//!
//! Rays of one anchor meet only there, so crossings give no position. But lists say who is near whom, and that draws a map:
//!
//! 1. Two slots have few listed records in common if they are far apart. This gives lengths of edges, and prunes wrong entries.
//! 2. Landmark multidimensional scaling of shortest paths (de Silva and Tenenbaum 2004) lays out all slots.
//! 3. An affine map moves the layout so that the anchors see its points along their rays.
//! 4. All ranges move together to where the lists are likeliest, by gradient steps on a likelihood like that of `ranking`, from soft to sharp.
//!
//! Step 3 is rough, and a layout may be folded. So the result counts only if clearly more listed records are then among the nearest.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::RecordId;
use crate::geometry::knn::Knn;
use crate::geometry::vector::{quantile, sub, widen};
use crate::neighbors::Neighborhoods;
use crate::parallel;
use crate::recover::map::{LineRow, Listers};
use crate::recover::result::Estimate;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

const LANDMARKS: usize = 100;
/// Number of layouts, from other landmarks each. One may be folded where another is not.
const LAYOUTS: usize = 4;
/// Neighbors have more neighbors in common than by chance, by this many standard deviations.
const LEAST_SHARED: f32 = 2.0;
/// Layouts need at least this fraction of the listed records as edges.
const LEAST_KEPT: f64 = 0.6;
/// A layout replaces estimates that agree with the lists less by this factor: folded ones agree almost as well as estimates of `joint`.
const CLEARLY: f64 = 1.2;
/// A layout with this agreement is not folded.
const SURE: f64 = 0.95;
/// Two discs of radius 1 at distance `d` share about `1 - d / 1.6` of their area, up to 1.5.
const LENGTH: f32 = 1.6;
const LEAST_LENGTH: f32 = 0.1;
/// Number of fits of the affine map, each weighted by the ranges of the one before.
const FITS: usize = 8;
/// Least range, as a fraction of the ray.
const LEAST_RANGE: f64 = 0.02;
/// Number of steps of gradient ascent, and softness and step size (of the logarithm of ranges) at its ends.
const STEPS: usize = 200;
const SOFTNESS: [f64; 2] = [0.8, 0.06];
const STEP: [f64; 2] = [0.05, 0.005];
/// Decay of the means of the gradient and of its square (Adam, Kingma and Ba 2015).
const DECAY: [f64; 2] = [0.8, 0.95];
/// Estimates beyond this many softness units of the squared radius are not pushed away.
const REACH: f64 = 6.0;

/// Returns the layout of the slots, or `start` if that agrees as well with the lists.
pub(crate) fn recover<const D: usize>(
    rows: &[LineRow<D>],
    (lists, listers): (&Neighborhoods, &Listers),
    start: Vec<Estimate<D>>,
) -> Vec<Estimate<D>> {
    let least = CLEARLY * agreement(lists, &start);
    let mut best = (least, start.clone());
    // The slots that list a record may count as its neighbors, too.
    let edges = [None, Some(listers)].map(|listers| Edges::new(lists, listers));
    for number in 0..LAYOUTS {
        let edges = &edges[number % 2];
        if edges.kept < LEAST_KEPT {
            continue;
        }
        let Some(layout) = landmark_scaling::<D>(edges, number) else { continue };
        let is_placed = |&slot: &u32| {
            let slot = slot as usize;
            layout[slot].is_some() && rows[slot].to.is_finite() && start[slot].is_known()
        };
        let slots: Vec<u32> = (0..rows.len() as u32).filter(is_placed).collect();
        let Some(ranges) = affine(rows, &layout, &slots) else { continue };
        let ascent = Ascent { rows, lists, listers, edges, slots: &slots };
        let mut estimates = start.clone();
        for (&slot, range) in slots.iter().zip(ascent.run(ranges)) {
            estimates[slot as usize].position = rows[slot as usize].at(range as f32);
        }
        let agreement = agreement(lists, &estimates);
        if agreement > best.0 {
            best = (agreement, estimates);
        }
        if agreement > SURE {
            break;
        }
    }
    best.1
}

/// Returns the fraction of listed records whose estimates are as near as the nearest ones in the number of the list.
fn agreement<const D: usize>(lists: &Neighborhoods, estimates: &[Estimate<D>]) -> f64 {
    let far = [f64::MAX.sqrt() / 4.0; D];
    let point = |e: &Estimate<D>| if e.is_known() { widen(&e.position) } else { far };
    let points: Vec<[f64; D]> = estimates.iter().map(point).collect();
    let Ok(tree) = Knn::new(&points) else { return 0.0 };
    let n_near = |slot: usize, near: &[(f64, u32)]| {
        let is_near = |record: &&RecordId| near.iter().any(|&(_, row)| row == record.0);
        lists.of(slot).iter().filter(is_near).count()
    };
    let near = tree.per_row(|slot| lists.of(slot).len(), n_near);
    near.iter().sum::<usize>() as f64 / lists.records().len().max(1) as f64
}

/// Edges between likely neighbors, in both directions, with their lengths in radii.
struct Edges {
    of: Vec<Vec<(u32, f32)>>,
    kept: f64,
}

impl Edges {
    /// With `listers`, the slots that list a record count as its neighbors, too.
    fn new(lists: &Neighborhoods, listers: Option<&Listers>) -> Self {
        let n = lists.n_slots();
        let near = |slot: usize| -> Vec<u32> {
            let own = lists.of(slot).iter().map(|record| record.index() as u32);
            // A slot is its own nearest neighbor.
            let mut near: Vec<u32> = own.chain([slot as u32]).collect();
            near.extend_from_slice(listers.map_or(&[], |listers| listers.of(slot)));
            near.sort_unstable();
            near.dedup();
            near
        };
        let near = parallel::map(n, near);
        let mean = near.iter().map(Vec::len).sum::<usize>() as f32 / n.max(1) as f32;
        let by_chance = mean * mean / n.max(1) as f32;
        let least = by_chance + LEAST_SHARED * by_chance.sqrt() + 1.0;
        let shared = |slot: usize| -> Vec<(u32, f32)> {
            let own = &near[slot];
            let of_record = |record: &RecordId| {
                let theirs = &near[record.index()];
                let n_shared = theirs.iter().filter(|slot| own.binary_search(slot).is_ok()).count();
                let mean = ((own.len() * theirs.len()) as f32).sqrt();
                (n_shared as f32 >= least).then(|| (record.index() as u32, n_shared as f32 / mean))
            };
            lists.of(slot).iter().filter_map(of_record).collect()
        };
        let shares = parallel::map(n, shared);
        let mut sorted: Vec<f64> = shares.iter().flatten().map(|&(_, s)| f64::from(s)).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let kept = sorted.len() as f64 / lists.records().len().max(1) as f64;
        // Wrong entries lower all shares alike.
        let most = if sorted.is_empty() { 1.0 } else { quantile(&sorted, 0.95) as f32 };
        let mut of: Vec<Vec<(u32, f32)>> = vec![Vec::new(); n];
        for (slot, edges) in shares.iter().enumerate() {
            for &(record, share) in edges {
                let length = (LENGTH * (1.0 - share / most)).clamp(LEAST_LENGTH, LENGTH);
                of[slot].push((record, length));
                of[record as usize].push((slot as u32, length));
            }
        }
        for edges in &mut of {
            edges.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
            edges.dedup_by_key(|edge| edge.0);
        }
        Self { of, kept }
    }

    /// Returns the length of the shortest path from `from` to each slot.
    fn shortest_paths(&self, from: usize) -> Vec<f32> {
        let mut length = vec![f32::INFINITY; self.of.len()];
        length[from] = 0.0;
        // The bits of lengths are ordered as they are.
        let mut open = BinaryHeap::from([Reverse((0u32, from as u32))]);
        while let Some(Reverse((bits, slot))) = open.pop() {
            let reached = f32::from_bits(bits);
            if reached > length[slot as usize] {
                continue;
            }
            for &(to, edge) in &self.of[slot as usize] {
                let through = reached + edge;
                if through < length[to as usize] {
                    length[to as usize] = through;
                    open.push(Reverse((through.to_bits(), to)));
                }
            }
        }
        length
    }
}

/// Lays out all slots that paths connect to most others. Returns `None` if there are too few.
fn landmark_scaling<const D: usize>(edges: &Edges, number: usize) -> Option<Vec<Option<[f64; D]>>> {
    let n = edges.of.len();
    let every = n.div_ceil(LANDMARKS).max(1);
    let landmarks: Vec<usize> = (number % every..n).step_by(every).collect();
    let of_landmark = |at: usize| (landmarks[at], edges.shortest_paths(landmarks[at]));
    let sees_most = |(_, lengths): &(usize, Vec<f32>)| {
        2 * lengths.iter().filter(|length| length.is_finite()).count() > n
    };
    let mut paths = parallel::map(landmarks.len(), of_landmark);
    paths.retain(sees_most);
    let m = paths.len();
    if m <= D {
        return None;
    }
    let squared = |a: usize, slot: usize| f64::from(paths[a].1[slot]).powi(2);
    let mean = |a: usize| paths.iter().map(|path| squared(a, path.0)).sum::<f64>() / m as f64;
    let mean: Vec<f64> = (0..m).map(mean).collect();
    let all = mean.iter().sum::<f64>() / m as f64;
    let gram = DMatrix::from_fn(m, m, |a, b| {
        let path = (squared(a, paths[b].0) + squared(b, paths[a].0)) / 2.0;
        -0.5 * (path - mean[a] - mean[b] + all)
    });
    let eigen = SymmetricEigen::try_new(gram, f64::EPSILON, 1000)?;
    let mut order: Vec<usize> = (0..m).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    if eigen.eigenvalues[order[D - 1]] <= 0.0 {
        return None;
    }
    let place = |slot: usize| {
        let place: [f64; D] = std::array::from_fn(|c| {
            let vector = eigen.eigenvectors.column(order[c]);
            let sum: f64 = (0..m).map(|a| vector[a] * (squared(a, slot) - mean[a])).sum();
            -0.5 * sum / eigen.eigenvalues[order[c]]
        });
        place.iter().all(|x| x.is_finite()).then_some(place)
    };
    Some((0..n).map(place).collect())
}

/// Fits the affine map under which anchors see the layout along their rays; returns the ranges of `slots`.
fn affine<const D: usize>(
    rows: &[LineRow<D>],
    layout: &[Option<[f64; D]>],
    slots: &[u32],
) -> Option<Vec<f64>> {
    let n = D + 1;
    let mut ranges = vec![1.0; slots.len()];
    // Rows and homogeneous coordinates.
    let placed = |&slot: &u32| -> Option<(&LineRow<D>, Vec<f64>)> {
        let place = layout[slot as usize]?.into_iter().chain([1.0]).collect();
        Some((&rows[slot as usize], place))
    };
    let placed: Vec<_> = slots.iter().map(placed).collect::<Option<_>>()?;
    for fit in 0..FITS {
        let mut normal = DMatrix::zeros(D * n, D * n);
        let mut right = DVector::zeros(D * n);
        for ((row, place), range) in placed.iter().zip(&ranges) {
            let weight = if fit == 0 { 1.0 } else { 1.0 / (range * range) };
            // The components across the ray of `M place - anchor`.
            let across = |a: usize, b: usize| {
                let unit = if a == b { 1.0 } else { 0.0 };
                unit - f64::from(row.direction[a]) * f64::from(row.direction[b])
            };
            for (a, b) in (0..D).flat_map(|a| (0..D).map(move |b| (a, b))) {
                let part = weight * across(a, b);
                for i in 0..n {
                    right[a * n + i] += part * place[i] * f64::from(row.through[b]);
                    for j in 0..n {
                        normal[(a * n + i, b * n + j)] += part * place[i] * place[j];
                    }
                }
            }
        }
        let map: DVector<f64> = normal.lu().solve(&right)?;
        if !map.iter().all(|x| x.is_finite()) {
            return None;
        }
        for ((row, place), range) in placed.iter().zip(&mut ranges) {
            let along = |c: usize| {
                let x: f64 = (0..n).map(|i| map[c * n + i] * place[i]).sum();
                (x - f64::from(row.through[c])) * f64::from(row.direction[c])
            };
            let to = f64::from(row.to);
            *range = (0..D).map(along).sum::<f64>().clamp(LEAST_RANGE * to, to);
        }
    }
    Some(ranges)
}

struct Ascent<'a, const D: usize> {
    rows: &'a [LineRow<D>],
    lists: &'a Neighborhoods,
    listers: &'a Listers,
    edges: &'a Edges,
    slots: &'a [u32],
}

impl<const D: usize> Ascent<'_, D> {
    fn run(&self, ranges: Vec<f64>) -> Vec<f64> {
        let to = |slot: &u32| libm::log(f64::from(self.rows[*slot as usize].to));
        let most: Vec<f64> = self.slots.iter().map(to).collect();
        let mut at: Vec<f64> = ranges.iter().map(|&range| libm::log(range)).collect();
        let mut means = vec![[0.0; 2]; at.len()];
        for step in 0..STEPS {
            let between = |[first, last]: [f64; 2]| {
                first * libm::pow(last / first, step as f64 / (STEPS - 1) as f64)
            };
            let Some(gradient) = self.gradient(&at, between(SOFTNESS)) else { break };
            for (slot, g) in gradient.into_iter().enumerate() {
                let [mean, square] = &mut means[slot];
                *mean = DECAY[0] * *mean + (1.0 - DECAY[0]) * g;
                *square = DECAY[1] * *square + (1.0 - DECAY[1]) * g * g;
                let unbiased =
                    |mean: f64, decay: f64| mean / (1.0 - libm::pow(decay, step as f64 + 1.0));
                let size = unbiased(*square, DECAY[1]).sqrt().max(f64::MIN_POSITIVE);
                let moved = at[slot] + between(STEP) * unbiased(*mean, DECAY[0]) / size;
                at[slot] = moved.min(most[slot]);
            }
        }
        at.into_iter().map(libm::exp).collect()
    }

    /// Returns the derivatives of the log-likelihood by the logarithms of ranges.
    fn gradient(&self, at: &[f64], softness: f64) -> Option<Vec<f64>> {
        let point = |(&slot, &at): (&u32, &f64)| {
            let (own, range) = (&self.rows[slot as usize], libm::exp(at));
            std::array::from_fn(|c| f64::from(own.through[c]) + range * f64::from(own.direction[c]))
        };
        let points: &Vec<[f64; D]> = &self.slots.iter().zip(at).map(point).collect();
        let mut row_of = vec![None; self.rows.len()];
        (0u32..).zip(self.slots).for_each(|(row, &slot)| row_of[slot as usize] = Some(row));
        let tree = Knn::new(points).ok()?;
        let length = |row: usize| self.lists.of(self.slots[row] as usize).len();
        let radius2 = tree.per_row(length, |_, near| near.last().map_or(0.0, |last| last.0));
        let far = 1.0 + 2.0 * softness * REACH;
        let of_slot = |(marks, near): &mut (Vec<u8>, Vec<u32>), row: usize| {
            let slot = self.slots[row] as usize;
            near.clear();
            let mut mark = |slot: usize, bit: u8| {
                if let Some(row) = row_of[slot] {
                    if marks[row as usize] == 0 {
                        near.push(row);
                    }
                    marks[row as usize] |= bit | SEEN;
                }
            };
            self.lists.of(slot).iter().for_each(|record| mark(record.index(), LISTED));
            self.listers.of(slot).iter().for_each(|&lister| mark(lister as usize, LISTS));
            self.edges.of[slot].iter().for_each(|edge| mark(edge.0 as usize, EDGE));
            tree.within(&points[row], far * radius2[row], |row| {
                mark(self.slots[row as usize] as usize, 0);
            });
            let own = &self.rows[slot];
            let mut sum = 0.0;
            for near in near.iter().map(|&near| near as usize) {
                let mark = std::mem::take(&mut marks[near]);
                if near == row {
                    continue;
                }
                let away = sub(&points[near], &points[row]);
                let d2: f64 = away.iter().map(|x| x * x).sum();
                let slope = |radius2: f64, listed: bool| {
                    if radius2 <= 0.0 {
                        return 0.0;
                    }
                    let steps = (d2 / radius2 - 1.0) / (2.0 * softness);
                    let inside = 1.0 / (1.0 + libm::exp(steps.clamp(-30.0, 30.0)));
                    let slope = match listed {
                        true if mark & EDGE == 0 => 0.0,
                        true => 1.0 - inside,
                        false => {
                            let ratio = self.edges.kept.min(0.999);
                            -ratio * inside * (1.0 - inside) / (1.0 - ratio * inside)
                        }
                    };
                    slope / (2.0 * softness * radius2)
                };
                let slope =
                    slope(radius2[row], mark & LISTED > 0) + slope(radius2[near], mark & LISTS > 0);
                let along: f64 = (0..D).map(|c| away[c] * f64::from(own.direction[c])).sum();
                sum += 2.0 * slope * along;
            }
            sum * libm::exp(at[row])
        };
        let buffers = || (vec![0u8; points.len()], Vec::new());
        Some(parallel::map_with(points.len(), buffers, of_slot))
    }
}

/// What is known of a pair of slots.
const SEEN: u8 = 1;
const LISTED: u8 = 2;
const LISTS: u8 = 4;
const EDGE: u8 = 8;
