//! The estimates around each slot: slots near each other share one search, and each gets its radius.

use rayon::prelude::*;

use crate::geometry::knn::Knn;
use crate::geometry::vector::squared_distance;
use crate::neighbors::Neighborhoods;
use crate::recover::map::places::distance2;
use crate::recover::result::{Estimate, Status};
use crate::simd::{Kernel, dispatch};

/// Estimates within this many radii are compared with a list.
pub(super) const NEAR: f32 = 1.6;
/// A slot belongs to a group if all estimates within this many radii of it are near the group.
const COVERED: f32 = 1.45;
/// Number of slots in a group.
const GROUP: usize = 16;
/// Largest number of estimates near a group, as a multiple of the length of lists.
const MOST_NEAR: usize = 16;
/// Largest number of passes that look for a radius.
const PASSES: usize = 8;

/// Slots whose estimates are near each other.
pub(super) struct Group {
    pub(super) members: Vec<u32>,
    /// Slots near the members, themselves included.
    pub(super) near: Vec<u32>,
}

/// The estimates around every slot.
#[derive(Default)]
pub(super) struct Surroundings {
    /// Distance within which as many estimates lie as the list of the slot is long; 0 for slots without estimate or list.
    pub(super) radius: Vec<f32>,
    pub(super) groups: Vec<Group>,
    /// Group of each slot with an estimate.
    pub(super) group_of: Vec<u32>,
}

impl Surroundings {
    /// Returns `None` if no slot has an estimate.
    pub(super) fn new<const D: usize>(
        estimates: &[Estimate<D>],
        lists: &Neighborhoods,
    ) -> Option<Self> {
        let is_known = |slot: &u32| estimates[*slot as usize].status == Status::Ok;
        let slots: Vec<u32> = (0..estimates.len() as u32).filter(is_known).collect();
        let point = |slot: &u32| estimates[*slot as usize].position.map(f64::from);
        let points: Vec<[f64; D]> = slots.iter().map(point).collect();
        let tree = Knn::new(&points).ok()?;
        let mean_length = lists.records().len() / estimates.len();
        let grouping = Grouping { tree: &tree, points: &points, slots: &slots, lists, mean_length };
        let groups = |near: &mut Near<D>, rows: &[u32]| {
            let mut groups = Vec::new();
            grouping.add(rows, near, &mut groups);
            groups
        };
        let patches = tree.patches(GROUP).into_par_iter();
        let found: Vec<Vec<(Group, Vec<f32>)>> = patches.map_init(Near::default, groups).collect();
        let (mut radius, mut group_of) = (vec![0.0; estimates.len()], vec![0; estimates.len()]);
        let mut groups = Vec::new();
        for (group, radii) in found.into_iter().flatten() {
            for (&slot, &r) in group.members.iter().zip(&radii) {
                (radius[slot as usize], group_of[slot as usize]) = (r, groups.len() as u32);
            }
            groups.push(group);
        }
        Some(Self { radius, groups, group_of })
    }

    /// Computes the radii again after small moves. The groups stay.
    pub(super) fn update<const D: usize>(
        &mut self,
        estimates: &[Estimate<D>],
        lists: &Neighborhoods,
    ) {
        let before = &self.radius;
        let radii = |near: &mut Near<D>, group: &Group| -> Vec<f32> {
            near.clear();
            for &slot in &group.near {
                near.add(slot, estimates[slot as usize].position);
            }
            let radius = |&slot: &u32| {
                let slot = slot as usize;
                let (x, wanted) = (estimates[slot].position, lists.of(slot).len() + 1);
                let radius = Radius { near: &mut *near, x, wanted, most: COVERED * before[slot] };
                dispatch(radius).unwrap_or(before[slot])
            };
            group.members.iter().map(radius).collect()
        };
        let found: Vec<Vec<f32>> = self.groups.par_iter().map_init(Near::default, radii).collect();
        for (group, radii) in self.groups.iter().zip(found) {
            for (&slot, radius) in group.members.iter().zip(radii) {
                self.radius[slot as usize] = radius;
            }
        }
    }
}

/// Buffers of one thread: the slots and estimates near a group.
struct Near<const D: usize> {
    slots: Vec<u32>,
    x: [Vec<f32>; D],
    squared: Vec<f32>,
    found: Vec<(f64, u32)>,
}

impl<const D: usize> Default for Near<D> {
    fn default() -> Self {
        let x = std::array::from_fn(|_| Vec::new());
        Self { slots: Vec::new(), x, squared: Vec::new(), found: Vec::new() }
    }
}

impl<const D: usize> Near<D> {
    fn clear(&mut self) {
        self.slots.clear();
        self.x.iter_mut().for_each(Vec::clear);
    }

    #[inline(always)]
    fn add(&mut self, slot: u32, x: [f32; D]) {
        self.slots.push(slot);
        (0..D).for_each(|c| self.x[c].push(x[c]));
    }
}

/// What groups are made from.
struct Grouping<'a, const D: usize> {
    tree: &'a Knn<'a, D>,
    points: &'a [[f64; D]],
    slots: &'a [u32],
    lists: &'a Neighborhoods,
    mean_length: usize,
}

impl<const D: usize> Grouping<'_, D> {
    /// Adds the group of `rows`, with the radius of each slot. Slots that do not fit get groups of their own.
    fn add(&self, rows: &[u32], near: &mut Near<D>, groups: &mut Vec<(Group, Vec<f32>)>) {
        let Self { tree, points, slots, lists, mean_length } = *self;
        let middle: [f64; D] = std::array::from_fn(|c| {
            let mut column: Vec<f64> = rows.iter().map(|&row| points[row as usize][c]).collect();
            let middle = column.len() / 2;
            *column.select_nth_unstable_by(middle, f64::total_cmp).1
        });
        let away = |row: u32| squared_distance(&middle, &points[row as usize]).sqrt();
        tree.nearest_to(middle, mean_length + 1, &mut near.found);
        let typical = near.found.last().map_or(0.0, |last| 1.25 * last.0.sqrt());
        let farthest = rows.iter().map(|&row| away(row)).fold(0.0, f64::max);
        let is_one = rows.len() == 1;
        let most = MOST_NEAR * mean_length;
        let mut within = farthest + f64::from(NEAR) * typical;
        let (mut members, mut radii) = (Vec::new(), Vec::new());
        loop {
            near.clear();
            dispatch(Within { grouping: self, middle: &middle, within, near: &mut *near });
            let is_crowded = near.slots.len() > most;
            if is_crowded && is_one {
                let mut found = std::mem::take(&mut near.found);
                tree.nearest_to(middle, most, &mut found);
                near.clear();
                for &(_, row) in &found {
                    near.add(slots[row as usize], points[row as usize].map(|x| x as f32));
                }
                near.found = found;
            }
            let is_all = near.slots.len() == slots.len() || (is_crowded && is_one);
            for &row in rows.iter().filter(|_| is_one || !is_crowded) {
                let slot = slots[row as usize];
                let x = points[row as usize].map(|x| x as f32);
                let most = if is_all { f64::INFINITY } else { within - away(row) };
                let wanted = lists.of(slot as usize).len() + 1;
                let radius = match wanted {
                    1 => Some(0.0),
                    _ if most <= 0.0 && !is_one => None,
                    _ => dispatch(Radius { near: &mut *near, x, wanted, most: most as f32 }),
                };
                let covers = |radius: &f32| is_all || f64::from(COVERED * radius) <= most;
                if let Some(radius) = radius.filter(covers) {
                    members.push(slot);
                    radii.push(radius);
                }
            }
            if !is_one || members.len() == 1 {
                break;
            }
            within = (1.5 * within).max(f64::MIN_POSITIVE);
        }
        if !members.is_empty() {
            let near = near.slots.clone();
            groups.push((Group { members: members.clone(), near }, radii));
        }
        let is_left = |row: &u32| !members.contains(&slots[*row as usize]);
        let left: Vec<u32> = rows.iter().copied().filter(is_left).collect();
        // If no slot fits, the group is halved.
        let parts = if members.is_empty() { left.len().div_ceil(2) } else { left.len().max(1) };
        left.chunks(parts).for_each(|rows| self.add(rows, near, groups));
    }
}

/// Gathers all estimates within a distance of a place.
struct Within<'a, 'b, const D: usize> {
    grouping: &'a Grouping<'b, D>,
    middle: &'a [f64; D],
    within: f64,
    near: &'a mut Near<D>,
}

impl<const D: usize> Kernel for Within<'_, '_, D> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { grouping: Grouping { tree, slots, .. }, middle, within, near } = self;
        tree.within(middle, (within * within, usize::MAX), |row, x| {
            near.add(slots[row as usize], x.map(|x| x as f32));
        });
    }
}

/// Finds the distance from `x` to the `wanted`-th nearest estimate; `None` if it is above `most`.
struct Radius<'a, const D: usize> {
    near: &'a mut Near<D>,
    x: [f32; D],
    wanted: usize,
    most: f32,
}

impl<const D: usize> Kernel for Radius<'_, D> {
    type Output = Option<f32>;

    #[inline(always)]
    fn run(self) -> Option<f32> {
        let Self { near: Near { slots, x: columns, squared, .. }, x, wanted, most } = self;
        let n = slots.len();
        squared.resize(n, 0.0);
        let (columns, squared): ([&[f32]; D], _) =
            (std::array::from_fn(|c| &columns[c][..n]), &mut squared[..n]);
        for i in 0..n {
            squared[i] = distance2(&std::array::from_fn(|c| columns[c][i]), &x);
        }
        let count =
            |bound: f32| squared.iter().map(|&s| u32::from(s <= bound)).sum::<u32>() as usize;
        let is_all = most == f32::INFINITY;
        let wanted = if is_all { wanted.min(n) } else { wanted };
        let mut high = match is_all {
            true => squared.iter().fold(0.0, |most: f32, &s| most.max(s)),
            false => most * most,
        };
        let (mut low, mut below, mut above) = (0.0, 0, count(high));
        if above < wanted {
            return None;
        }
        for pass in 0..PASSES {
            if above == wanted {
                let within = squared.iter().map(|&s| if s <= high { s } else { 0.0 });
                return Some(within.fold(0.0, f32::max).sqrt());
            }
            // Interpolation alone may approach from one side only.
            let share = match pass % 2 {
                0 => ((wanted - below) as f32 + 0.5) / (above - below) as f32,
                _ => 0.5,
            };
            let guess = low + (high - low) * share;
            let within = count(guess);
            if within >= wanted {
                (high, above) = (guess, within);
            } else {
                (low, below) = (guess, within);
            }
        }
        // Piles of estimates take too many passes.
        Some(squared.select_nth_unstable_by(wanted - 1, f32::total_cmp).1.sqrt())
    }
}
