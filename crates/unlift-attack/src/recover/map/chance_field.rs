//! How likely a random listed record passes near a place: the density of records, from the marginal of
//! who is listed.
//!
//! A line passes within `delta` of a place `x` with probability `density(x) * tube(delta)`, where the
//! density is the expected length of line per volume and the tube the volume per length. The density
//! varies over the size of a room, not over `delta`, so a coarse grid knows it better than a sample of
//! records does, for every delta at once.

use rayon::prelude::*;

use super::bytes::{Reader, Writer};
use super::cells::Grid;
use super::evidence::MOST_CHANCE;
use super::line_rows::LineRow;
use crate::Error;
use crate::neighbors::Neighborhoods;
use crate::simd::{Kernel, dispatch};

/// Cells of a grid at most: 32 per axis, as density varies over the size of a room.
const CELLS: usize = 1 << 15;
/// Records whose density is summed, one per cell; of a larger map a part, spread over the file.
const RECORDS: usize = 1 << 15;
/// Slots whose crossings with listed records tell where the map lies: enough for a quantile of 3 %.
const CROSSINGS: usize = 1 << 12;
/// The share of crossings left out on either side of the box: those of wrong entries may lie anywhere.
const TRIM: f64 = 0.03;
/// Every place has at least this share of the mean density: where no record was counted one vote would prove all.
const FLOOR: f32 = 0.05;
/// A map is flat if neighborhoods are more than so many times as wide as it is thin.
const FLAT: f64 = 2.0;

/// The density of records, per cell.
#[derive(Clone, Debug)]
pub(crate) struct ChanceField<const D: usize> {
    grid: Grid<D>,
}

impl<const D: usize> ChanceField<D> {
    /// `grid` holds sums of weighted length per cell; `weight` is that of all records.
    fn new(mut grid: Grid<D>, weight: f32) -> Self {
        grid.smooth();
        let volume: f32 = (0..D).map(|_| grid.cell()).product();
        let scale = 1.0 / (weight * volume).max(f32::MIN_POSITIVE);
        let mean = grid.values.iter().sum::<f32>() / grid.values.len() as f32;
        for value in &mut grid.values {
            *value = (value.max(FLOOR * mean) * scale).max(f32::MIN_POSITIVE);
        }
        Self { grid }
    }

    /// Appends the field to `to`.
    pub(crate) fn write(&self, to: &mut Writer) {
        self.grid.write(to);
    }

    /// The field that [`write`](Self::write) appended.
    ///
    /// # Errors
    /// When it is none.
    pub(crate) fn read(from: &mut Reader<'_>) -> Result<Self, Error> {
        // Grids of boxes without extent along an axis may exceed the number of cells asked for.
        Grid::read(from, 8 * CELLS).map(|grid| Self { grid })
    }

    /// The density at a typical place: the mean over places weighted by density.
    pub(crate) fn typical(&self) -> f32 {
        let (sum, squares) = self
            .grid
            .values
            .iter()
            .map(|&x| f64::from(x))
            .fold((0.0, 0.0), |(sum, squares), x| (sum + x, squares + x * x));
        (squares / sum) as f32
    }

    /// The chance that a random record passes through a region of volume-per-length `tube` about `x`.
    #[inline(always)]
    pub(crate) fn at(&self, x: &[f32; D], tube: f32) -> f32 {
        (self.grid.values[self.grid.index(x)] * tube).min(MOST_CHANCE)
    }

    /// Adds the same, however large, at each `t` of a line to `chance`, with room for a cell each.
    #[inline(always)]
    pub(crate) fn add_along(
        &self,
        (through, direction): (&[f32; D], &[f32; D]),
        t: &[f32],
        tube: f32,
        (cells, chance): (&mut [u32], &mut [f32]),
    ) {
        self.grid.cells_along(through, direction, t, cells);
        for (chance, &cell) in chance.iter_mut().zip(cells.iter()) {
            *chance += self.grid.values[cell as usize] * tube;
        }
    }
}

/// Volume per length of the tube of radius `delta` around a line in `D` dimensions.
pub(crate) fn tube(dimensions: usize, delta: f32) -> f32 {
    // The volume of the unit ball in D - 1 dimensions.
    match dimensions {
        0 | 1 => 1.0,
        2 => 2.0 * delta,
        _ => std::f32::consts::PI * delta * delta,
    }
}

/// Fields for lines (one) or rays (one per center: those of the other centers).
pub(crate) fn of_lines<const D: usize>(
    rows: &[LineRow<D>],
    lists: &Neighborhoods,
    slots_per_record: usize,
) -> Vec<ChanceField<D>> {
    let n_groups = n_groups(rows);
    let (low, high) = box_of_crossings(rows, lists, slots_per_record);
    let counts = times_listed(lists, rows.len());
    let every = rows.len().div_ceil(RECORDS).max(1);
    let chosen: Vec<usize> = (0..rows.len()).step_by(every).collect();
    (0..n_groups.unwrap_or(1))
        .map(|own| {
            let of_others = |&&record: &&usize| n_groups.is_none() || rows[record].group != own;
            let chosen: Vec<usize> = chosen.iter().filter(of_others).copied().collect();
            let empty = Grid::over(low, high, CELLS);
            let weight = chosen.iter().map(|&r| counts[r] as f32).sum();
            let parts: Vec<Grid<D>> = chosen
                .par_chunks(chosen.len().div_ceil(8).max(1))
                .map(|part| dispatch(Lengths { grid: empty.clone(), rows, counts: &counts, part }))
                .collect();
            ChanceField::new(sum(empty, &parts), weight)
        })
        .collect()
}

/// Centers of rays, counted up to the last that any ray comes from; `None` of lines.
fn n_groups<const D: usize>(rows: &[LineRow<D>]) -> Option<u32> {
    rows.iter().filter(|row| row.is_ray()).map(|row| row.group + 1).max()
}

/// The number of fields that [`of_lines`] makes.
pub(crate) fn n_fields<const D: usize>(rows: &[LineRow<D>]) -> usize {
    n_groups(rows).unwrap_or(1) as usize
}

/// Adds the lengths of some records, each as often as it is listed, to a grid.
struct Lengths<'a, const D: usize> {
    grid: Grid<D>,
    rows: &'a [LineRow<D>],
    counts: &'a [u32],
    part: &'a [usize],
}

impl<const D: usize> Kernel for Lengths<'_, D> {
    type Output = Grid<D>;

    #[inline(always)]
    fn run(self) -> Grid<D> {
        let Self { mut grid, rows, counts, part } = self;
        let mut buffers = (Vec::new(), Vec::new());
        for &record in part {
            add_line(&mut grid, &rows[record], counts[record] as f32, &mut buffers);
        }
        grid
    }
}

fn sum<const D: usize>(mut total: Grid<D>, parts: &[Grid<D>]) -> Grid<D> {
    for part in parts {
        total.values.iter_mut().zip(&part.values).for_each(|(a, b)| *a += b);
    }
    total
}

#[inline(always)]
fn add_line<const D: usize>(
    grid: &mut Grid<D>,
    row: &LineRow<D>,
    weight: f32,
    buffers: &mut (Vec<f32>, Vec<u32>),
) {
    let Some((from, to)) = grid.clip(&row.through, &row.direction, row.floor(), row.to) else {
        return;
    };
    let steps = ((to - from) / grid.cell()).ceil().max(1.0);
    let step = (to - from) / steps;
    let (t, cells) = buffers;
    t.clear();
    t.extend((0..steps as i32).map(|i| from + (i as f32 + 0.5) * step));
    cells.resize(t.len(), 0);
    grid.cells_along(&row.through, &row.direction, t, cells);
    for &cell in cells.iter() {
        grid.values[cell as usize] += weight * step;
    }
}

/// How often each record is listed.
fn times_listed(lists: &Neighborhoods, n_records: usize) -> Vec<u32> {
    let mut counts = vec![0; n_records];
    lists.records().iter().for_each(|record| counts[record.index()] += 1);
    counts
}

/// The box that holds most places where records pass nearest to slots that list them.
fn box_of_crossings<const D: usize>(
    rows: &[LineRow<D>],
    lists: &Neighborhoods,
    slots_per_record: usize,
) -> ([f32; D], [f32; D]) {
    let every = lists.n_slots().div_ceil(CROSSINGS).max(1);
    let mut places: [Vec<f32>; D] = std::array::from_fn(|_| Vec::new());
    for slot in (0..lists.n_slots()).step_by(every) {
        let own = &rows[slot / slots_per_record];
        // Any entry will do: lists are in order of record, which is random.
        for record in lists.of(slot).iter().take(2) {
            if let Some(place) = own.crossing(&rows[record.index()]) {
                for c in 0..D {
                    places[c].push(place[c]);
                }
            }
        }
    }
    let ends = places.map(|mut column| trimmed(&mut column));
    (ends.map(|e| e.0), ends.map(|e| e.1))
}

/// The range of a column without its ends, widened a little.
pub(crate) fn trimmed(column: &mut [f32]) -> (f32, f32) {
    if column.is_empty() {
        return (0.0, 0.0);
    }
    let last = column.len() - 1;
    let cut = (last as f64 * TRIM) as usize;
    let mut at = |rank: usize| *column.select_nth_unstable_by(rank, f32::total_cmp).1;
    let (low, high) = (at(cut), at(last - cut));
    let margin = 0.1 * (high - low);
    (low - margin, high + margin)
}

/// One field for axis candidates: the density of the records' lines along all axes.
pub(crate) fn of_candidates<const D: usize>(
    rows: &[[f32; D]],
    lists: &Neighborhoods,
) -> CandidateField<D> {
    let counts = times_listed(lists, rows.len());
    let ends: [(f32, f32); D] =
        std::array::from_fn(|c| trimmed(&mut rows.iter().map(|row| row[c]).collect::<Vec<f32>>()));
    let weight: f32 = counts.iter().map(|&n| n as f32).sum();
    let along = std::array::from_fn(|axis| {
        let low = std::array::from_fn(|c| if c == axis { 0.0 } else { ends[c].0 });
        let high = std::array::from_fn(|c| if c == axis { 0.0 } else { ends[c].1 });
        let mut grid = Grid::over(low, high, CELLS / 8);
        // All of the line lies in the one cell along its own axis: a unit of length per unit.
        let length = grid.cell();
        for (row, &n) in rows.iter().zip(&counts) {
            let cell = grid.index(row);
            grid.values[cell] += n as f32 * length;
        }
        ChanceField::new(grid, weight)
    });
    CandidateField { along }
}

/// The density of the lines through published points, per axis along which they run.
#[derive(Clone, Debug)]
pub(crate) struct CandidateField<const D: usize> {
    along: [ChanceField<D>; D],
}

impl<const D: usize> CandidateField<D> {
    /// Appends the fields to `to`.
    pub(crate) fn write(&self, to: &mut Writer) {
        self.along.iter().for_each(|field| field.write(to));
    }

    /// The fields that [`write`](Self::write) appended.
    ///
    /// # Errors
    /// When there are not as many.
    pub(crate) fn read(from: &mut Reader<'_>) -> Result<Self, Error> {
        let fields = (0..D).map(|_| ChanceField::read(from)).collect::<Result<Vec<_>, _>>()?;
        let along = fields.try_into();
        along
            .map(|along| Self { along })
            .map_err(|_| Error::new("model", "a field per axis", "others"))
    }

    /// The density at a typical place.
    fn typical(&self) -> f32 {
        self.along.iter().map(ChanceField::typical).sum()
    }

    /// How likely a random record agrees with a place where records are, within `delta`.
    pub(crate) fn typical_chance(&self, delta: f32) -> f32 {
        let tubes = self.tubes(delta);
        if tubes.iter().all(|&one| one == tubes[0]) {
            return self.typical() * tubes[0];
        }
        self.along.iter().zip(&tubes).map(|(field, tube)| field.typical() * tube).sum()
    }

    /// Where the box of the map is much thinner than its neighborhoods are wide: the radius of the disc that holds a `share` of
    /// it; `None` of other boxes.
    pub(crate) fn radius_if_flat(&self, share: f64) -> Option<f64> {
        // Each field lacks the extent along its own axis.
        let side = |c: usize| f64::from(self.along[(c + 1) % D].grid.sides()[c]);
        let mut sides: [f64; D] = std::array::from_fn(side);
        sides.sort_unstable_by(f64::total_cmp);
        let [thin, middle, long] = sides[..] else { return None };
        let radius = (share * middle * long / std::f64::consts::PI).sqrt();
        (FLAT * thin < radius && 2.0 * radius <= middle).then_some(radius)
    }

    /// Volume per length of what is within `delta` of a line along each axis: of a map that is flat no more of it than lies
    /// in its box.
    pub(crate) fn tubes(&self, delta: f32) -> [f32; D] {
        std::array::from_fn(|axis| {
            let sides = self.along[axis].grid.sides();
            let across = |c: &usize| *c != axis;
            let whole = tube(D, delta);
            let is_cut = |c: usize| 2.0 * delta > sides[c];
            if !(0..D).filter(across).any(is_cut) {
                return whole;
            }
            let share = (0..D).filter(across).map(|c| (sides[c] / (2.0 * delta)).min(1.0));
            whole * share.product::<f32>()
        })
    }

    /// The chance that any of a random record's lines passes through a tube about `x`.
    #[inline(always)]
    pub(crate) fn at(&self, x: &[f32; D], tubes: &[f32; D]) -> f32 {
        let along = self.along.iter().zip(tubes);
        along.map(|(field, &tube)| field.at(x, tube)).sum::<f32>().min(MOST_CHANCE)
    }

    /// Adds the same, however large, at each `t` of the line through `own` along `axis` to `chance`, with room for
    /// a cell each.
    #[inline(always)]
    pub(crate) fn add_along(
        &self,
        (own, axis): (&[f32; D], usize),
        t: &[f32],
        tubes: &[f32; D],
        (cells, chance): (&mut [u32], &mut [f32]),
    ) {
        let through = std::array::from_fn(|c| if c == axis { 0.0 } else { own[c] });
        let direction = std::array::from_fn(|c| if c == axis { 1.0 } else { 0.0 });
        for (field, &tube) in self.along.iter().zip(tubes) {
            field.add_along((&through, &direction), t, tube, (&mut *cells, &mut *chance));
        }
    }
}
