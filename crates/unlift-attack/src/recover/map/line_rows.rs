//! Lines and rays as rows of one table, and their sections with a feasible line.

use super::sections::{NO_VOTE, Sections};
use crate::RecordId;
use crate::geometry::frame::Bounds;
use crate::geometry::vector::{along, widen};
use crate::released::{Lines, Rays};

/// One line or ray: half a cache line, so that a neighbor costs one memory access.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(crate) struct LineRow<const D: usize> {
    /// A point of the line: the foot, or the center of a ray.
    pub(crate) through: [f32; D],
    /// Unit direction; signed for rays.
    pub(crate) direction: [f32; D],
    /// The center of a ray, or [`NO_GROUP`].
    pub(crate) group: u32,
    /// Where it ends: infinite, except within known bounds.
    pub(crate) to: f32,
}

/// The group of lines, which all may vote for each other.
pub(crate) const NO_GROUP: u32 = u32::MAX;

/// Squared sines below this count as parallel: such a record does not tell where along the line.
const PARALLEL: f32 = 1e-6;

/// All records as rows; within `bounds` about the released origin, where these are known: a chord starts
/// where the line enters.
pub(crate) fn from_lines<const D: usize>(
    lines: &Lines<D>,
    bounds: Option<&Bounds<D>>,
) -> Vec<LineRow<D>> {
    let row = |(&foot, &direction): (&[f32; D], &[f32; D])| {
        let clip = |bounds: &Bounds<D>| bounds.clip(&widen(&foot), &widen(&direction));
        let (through, to) = match bounds.and_then(clip) {
            Some((from, to)) => (
                along(&widen(&foot), from, &widen(&direction)).map(|x| x as f32),
                (to - from) as f32,
            ),
            None => (foot, f32::INFINITY),
        };
        LineRow { through, direction, group: NO_GROUP, to }
    };
    lines.foot().iter().zip(lines.direction()).map(row).collect()
}

/// All records as rows; within the region of their center or else within `bounds`, where these are known.
pub(crate) fn from_rays<const D: usize>(
    rays: &Rays<D>,
    bounds: Option<&Bounds<D>>,
) -> Vec<LineRow<D>> {
    let row = |(&center, &direction): (&u8, &[f32; D])| {
        let through = rays.centers()[usize::from(center)];
        let region = rays.regions().map(|regions| &regions[usize::from(center)]).or(bounds);
        let clip = |region: &Bounds<D>| region.clip(&widen(&through), &widen(&direction));
        // A ray that leaves its region at once is a file's fault: nothing is known about it.
        let to = region.and_then(clip).map(|(_, to)| to as f32).filter(|&to| to > 0.0);
        let to = to.unwrap_or(f32::INFINITY);
        LineRow { through, direction, group: u32::from(center), to }
    };
    rays.center().iter().zip(rays.direction()).map(row).collect()
}

impl<const D: usize> LineRow<D> {
    /// Whether this is a half-line.
    #[inline(always)]
    pub(crate) fn is_ray(&self) -> bool {
        self.group != NO_GROUP
    }

    /// Whether this record is evidence for a point on `own`: rays of one center meet trivially.
    #[inline(always)]
    pub(crate) fn may_vote_for(&self, own: &Self) -> bool {
        !own.is_ray() || self.group != own.group
    }

    /// Where half-lines and chords begin to count.
    #[inline(always)]
    pub(crate) fn floor(&self) -> f32 {
        if self.group == NO_GROUP && self.to == f32::INFINITY { f32::NEG_INFINITY } else { 0.0 }
    }

    /// `t` moved to where the record is.
    #[inline(always)]
    pub(crate) fn clamp(&self, t: f32) -> f32 {
        t.max(self.floor()).min(self.to)
    }

    /// The point of this line nearest to `other`; `None` when they are parallel or it lies behind a
    /// center.
    pub(crate) fn crossing(&self, other: &Self) -> Option<[f32; D]> {
        let of_other = (other.through, other.direction, other.group);
        let (t, miss2, _) = self.section(of_other);
        (miss2 < NO_VOTE && t >= self.floor() && t <= self.to).then(|| self.at(t))
    }

    /// Where the record with this point, direction and group passes nearest, how far away (squared) and
    /// at which angle (squared sine).
    ///
    /// With `v` and `u` the parts of `self.through - through` and `self.direction` perpendicular to
    /// the record, the squared distance is `|v + t u|^2`: no difference of large squares, so that
    /// `f32` suffices far from the origin.
    #[inline(always)]
    fn section(&self, (through, direction, group): ([f32; D], [f32; D], u32)) -> (f32, f32, f32) {
        let (mut w_e, mut d_e) = (0.0, 0.0);
        for c in 0..D {
            w_e += (self.through[c] - through[c]) * direction[c];
            d_e += self.direction[c] * direction[c];
        }
        let v = |c: usize| self.through[c] - through[c] - w_e * direction[c];
        let u = |c: usize| self.direction[c] - d_e * direction[c];
        let (mut v_u, mut u_u) = (0.0, 0.0);
        for c in 0..D {
            v_u += v(c) * u(c);
            u_u += u(c) * u(c);
        }
        let parallel = u_u < PARALLEL;
        let t = if parallel { 0.0 } else { -v_u / u_u };
        let mut miss = 0.0;
        for c in 0..D {
            let m = v(c) + t * u(c);
            miss += m * m;
        }
        // Rays of one center meet trivially; a closest approach behind a center is none.
        let behind = self.is_ray() & ((group == self.group) | (w_e + t * d_e <= 0.0));
        let miss2 = if parallel | behind { NO_VOTE } else { miss };
        (t, miss2, if parallel { 1.0 } else { u_u })
    }

    /// The point at parameter `t`.
    #[inline(always)]
    pub(crate) fn at(&self, t: f32) -> [f32; D] {
        std::array::from_fn(|c| self.through[c] + t * self.direction[c])
    }
}

/// Neighbors gathered into one column per coordinate: the section loop then runs over whole vectors.
#[derive(Clone, Debug)]
pub(crate) struct LineColumns<const D: usize> {
    through: [Vec<f32>; D],
    direction: [Vec<f32>; D],
    group: Vec<u32>,
}

impl<const D: usize> Default for LineColumns<D> {
    fn default() -> Self {
        Self {
            through: std::array::from_fn(|_| Vec::new()),
            direction: std::array::from_fn(|_| Vec::new()),
            group: Vec::new(),
        }
    }
}

impl<const D: usize> LineColumns<D> {
    /// Gathers `records` from `rows`.
    #[inline(always)]
    pub(crate) fn gather(&mut self, rows: &[LineRow<D>], records: &[RecordId]) {
        let n = records.len();
        for column in self.through.iter_mut().chain(&mut self.direction) {
            column.resize(n, 0.0);
        }
        self.group.resize(n, NO_GROUP);
        let through = self.through.each_mut().map(|column| &mut column[..n]);
        let direction = self.direction.each_mut().map(|column| &mut column[..n]);
        let group = &mut self.group[..n];
        for j in 0..n {
            let row = &rows[records[j].index()];
            for c in 0..D {
                through[c][j] = row.through[c];
                direction[c][j] = row.direction[c];
            }
            group[j] = row.group;
        }
    }

    /// How many of the gathered records are evidence for a point on `own`.
    #[inline(always)]
    pub(crate) fn n_that_may_vote(&self, own: &LineRow<D>) -> usize {
        let strange = |&&group: &&u32| !own.is_ray() || group != own.group;
        self.group.iter().filter(strange).count()
    }

    /// The sections of the gathered records with `own`.
    #[inline(always)]
    pub(crate) fn sections(&self, own: &LineRow<D>, out: &mut Sections) {
        let n = self.group.len();
        out.resize(n);
        let through: [&[f32]; D] = std::array::from_fn(|c| &self.through[c][..n]);
        let direction: [&[f32]; D] = std::array::from_fn(|c| &self.direction[c][..n]);
        let group = &self.group[..n];
        let (at, miss2, bend) = (&mut out.at[..n], &mut out.miss2[..n], &mut out.bend[..n]);
        for j in 0..n {
            let through = std::array::from_fn(|c| through[c][j]);
            let direction = std::array::from_fn(|c| direction[c][j]);
            (at[j], miss2[j], bend[j]) = own.section((through, direction, group[j]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::{Draws, Stage};
    use crate::simd::{Kernel, dispatch, portable};

    /// Sections of a list with a line: a kernel whose rounding could differ between instruction sets.
    struct SectionBits<'a> {
        rows: &'a [LineRow<3>],
        own: usize,
    }

    impl Kernel for SectionBits<'_> {
        type Output = Vec<u32>;

        #[inline(always)]
        fn run(self) -> Vec<u32> {
            let records: Vec<RecordId> = (0..self.rows.len()).map(RecordId::from_index).collect();
            let mut columns = LineColumns::default();
            let mut sections = Sections::default();
            columns.gather(self.rows, &records);
            columns.sections(&self.rows[self.own], &mut sections);
            let columns = [&sections.at, &sections.miss2, &sections.bend];
            columns.into_iter().flatten().map(|x| x.to_bits()).collect()
        }
    }

    #[test]
    fn instruction_sets_change_no_bit() {
        let mut draws = Draws::new(5, Stage::Synthetic, 5);
        let points: Vec<[f64; 3]> =
            (0..403).map(|_| std::array::from_fn(|_| draws.between(-3.0, 3.0))).collect();
        let directions: Vec<[f64; 3]> = points.iter().map(|_| draws.direction()).collect();
        let rows = from_lines(&Lines::through(&points, &directions).unwrap(), None);
        for own in 0..50 {
            let bits = portable(SectionBits { rows: &rows, own });
            assert!(bits == dispatch(SectionBits { rows: &rows, own }));
        }
    }
}
