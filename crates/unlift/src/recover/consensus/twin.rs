//! A brute-force twin of the solvers: `f64` throughout, every interval start and every window tried,
//! nothing reused, nothing pruned. Only the null sample is shared, since it is drawn.

use super::solve;
use crate::RecordId;
use crate::neighbors::Neighborhoods;
use crate::recover::chunks::Chunks;
use crate::recover::family::Family;
use crate::recover::lists::Lists;
use crate::recover::null_sample::{NULL_RECORDS, draw};
use crate::recover::{Estimate, Status};
use crate::released::{AxisCandidates, AxisPlanes, Lines, Obfuscation, Rays, Released};
use crate::seed::{Draws, Stage};
use crate::{Error, Unit};

const SEED: u64 = 5;

/// A position that could win, and what decides.
#[derive(Debug)]
struct Choice {
    position: Vec<f64>,
    score: f64,
    evidence: f64,
}

/// `k KL(n / k || p)` nats above chance, else 0.
fn evidence(n: f64, k: f64, p: f64) -> f64 {
    let term = |hits: f64, chance: f64| {
        if hits == 0.0 { 0.0 } else { hits * (hits / (k * chance)).ln() }
    };
    if n <= p * k { 0.0 } else { term(n, p) + term(k - n, 1.0 - p) }
}

/// What one record says along a feasible line: the squared distance from the point at `t`.
struct Vote {
    /// Squared distance at the closest approach, its place, and how fast it grows.
    terms: Vec<(f64, f64, f64)>,
}

impl Vote {
    fn squared_distance(&self, t: f64) -> f64 {
        let at = |&(miss2, at, bend): &(f64, f64, f64)| miss2 + bend * (t - at) * (t - at);
        self.terms.iter().map(at).fold(f64::INFINITY, f64::min)
    }

    /// Whether it agrees with every position.
    fn is_everywhere(&self, delta: f64) -> bool {
        self.terms.iter().any(|&(miss2, _, bend)| bend == 0.0 && miss2 <= delta * delta)
    }

    /// Where the vote begins to count, if it does not count everywhere.
    fn start(&self, delta: f64) -> Option<f64> {
        if self.is_everywhere(delta) {
            return None;
        }
        let crossing = |&&(miss2, _, bend): &&(f64, f64, f64)| bend > 0.0 && miss2 <= delta * delta;
        let start =
            |&(miss2, at, bend): &(f64, f64, f64)| at - ((delta * delta - miss2) / bend).sqrt();
        self.terms.iter().filter(crossing).map(start).reduce(f64::min)
    }

    /// The place and weight with which it enters a refit: none if it agrees with every position.
    fn refit_term(&self, t: f64, delta: f64) -> (f64, f64) {
        if self.is_everywhere(delta) {
            return (0.0, 0.0);
        }
        let distance = |&(miss2, at, bend): &(f64, f64, f64)| miss2 + bend * (t - at) * (t - at);
        let best = self.terms.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        best.map_or((0.0, 0.0), |&(_, at, bend)| (at, bend))
    }
}

/// Every start of an interval with its score and the position least squares makes of it.
fn options_along(
    listed: &[Vote],
    null: &[Vote],
    k: usize,
    delta: f64,
    floor: f64,
    at: impl Fn(f64) -> Vec<f64>,
) -> Vec<Choice> {
    // A start counts for itself: rounding of a square root must not decide that.
    let slack = delta * delta * (1.0 + 1e-9);
    let count = |votes: &[Vote], t: f64| {
        votes.iter().filter(|vote| vote.squared_distance(t) <= slack).count() as f64
    };
    let end_above_floor = |vote: &Vote| {
        let end =
            |&(miss2, at, bend): &(f64, f64, f64)| at + ((delta * delta - miss2) / bend).sqrt();
        vote.terms.iter().map(end).fold(f64::NEG_INFINITY, f64::max) >= floor
    };
    let starts = listed.iter().filter(|vote| end_above_floor(vote));
    starts
        .filter_map(|vote| vote.start(delta))
        .map(|start| {
            let mut t = start.max(floor);
            let p = (count(null, t) + 0.5) / (NULL_RECORDS as f64 + 1.0);
            let evidence = evidence(count(listed, t), k as f64, p);
            let score = evidence + p.ln();
            for _ in 0..2 {
                let near: Vec<(f64, f64)> = listed
                    .iter()
                    .filter(|v| v.squared_distance(t) <= delta * delta * (1.0 + 1e-4))
                    .map(|v| v.refit_term(t, delta))
                    .collect();
                let weight: f64 = near.iter().map(|&(_, bend)| bend).sum();
                if weight > 0.0 {
                    t = near.iter().map(|&(at, bend)| bend * at).sum::<f64>() / weight;
                }
            }
            Choice { position: at(t.max(floor)), score, evidence }
        })
        .collect()
}

/// A line or ray in `f64`: through, direction, group.
type Line = ([f64; 3], [f64; 3], Option<u8>);

/// The section of `other` with `own`; `None` when it says nothing.
fn section(own: &Line, other: &Line) -> Option<Vote> {
    let dot = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|c| a[c] * b[c]).sum::<f64>();
    let (p, d, group) = own;
    let (q, e, other_group) = other;
    if group.is_some() && group == other_group {
        return None;
    }
    // Minimize |p + t d - q - s e|^2 over s, then over t.
    let w = [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
    let across = |v: &[f64; 3]| {
        let along = dot(v, e) / dot(e, e);
        [v[0] - along * e[0], v[1] - along * e[1], v[2] - along * e[2]]
    };
    let (v, u) = (across(&w), across(d));
    let bend = dot(&u, &u);
    if bend < 1e-6 {
        return None;
    }
    let t = -dot(&v, &u) / bend;
    let miss: Vec<f64> = (0..3).map(|c| v[c] + t * u[c]).collect();
    let s = dot(&w, e) + t * dot(d, e);
    if group.is_some() && s <= 0.0 {
        return None;
    }
    Some(Vote { terms: vec![(miss.iter().map(|x| x * x).sum(), t, bend)] })
}

/// The options of a slot on `own`, given the lines listed for it and the null sample.
fn line_options(
    rows: &[Line],
    own: usize,
    listed: &[usize],
    null: &[usize],
    delta: f64,
) -> Vec<Choice> {
    let own = &rows[own];
    let votes = |of: &[usize]| -> Vec<Vote> {
        of.iter().filter_map(|&other| section(own, &rows[other])).collect()
    };
    let may_vote = |&&other: &&usize| own.2.is_none() || rows[other].2 != own.2;
    let k = listed.iter().filter(may_vote).count();
    let floor = if own.2.is_some() { 0.0 } else { f64::NEG_INFINITY };
    let votes_of_listed = votes(listed);
    if votes_of_listed.len() < 2 {
        return Vec::new();
    }
    let at = |t: f64| (0..3).map(|c| own.0[c] + t * own.1[c]).collect();
    options_along(&votes_of_listed, &votes(null), k, delta, floor, at)
}

/// The options of an axis candidate: each own axis against all lines of every record.
fn candidate_options(
    rows: &[[f64; 3]],
    own: usize,
    listed: &[usize],
    null: &[usize],
    delta: f64,
) -> Vec<Choice> {
    let p = rows[own];
    let mut options = Vec::new();
    for axis in 0..3 {
        let vote = |&other: &usize| {
            let q = rows[other];
            let line = |free: usize| {
                let rest = (0..3).filter(|&c| c != axis && c != free);
                let miss2 = rest.map(|c| (q[c] - p[c]) * (q[c] - p[c])).sum();
                (miss2, q[axis], if free == axis { 0.0 } else { 1.0 })
            };
            Vote { terms: (0..3).map(line).collect() }
        };
        let votes = |of: &[usize]| of.iter().map(vote).collect::<Vec<_>>();
        let at = |t: f64| (0..3).map(|c| if c == axis { t } else { p[c] }).collect();
        let none = f64::NEG_INFINITY;
        options.extend(options_along(&votes(listed), &votes(null), listed.len(), delta, none, at));
    }
    options
}

/// The options of one free axis of a plane: every window that starts at a listed offset. Position
/// is the one coordinate.
fn window_options(
    axes: &[u8],
    offsets: &[f64],
    axis: u8,
    listed: &[usize],
    delta: f64,
) -> Vec<Choice> {
    let of_axis: Vec<usize> = (0..axes.len()).filter(|&r| axes[r] == axis).collect();
    let listed: Vec<f64> =
        listed.iter().filter(|&&r| axes[r] == axis).map(|&r| offsets[r]).collect();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let within = |from: f64, to: f64| {
        listed.iter().copied().filter(|&x| x >= from && x <= to).collect::<Vec<_>>()
    };
    let window = |&start: &f64| {
        let inside = within(start, start + 2.0 * delta);
        let by_chance = |&&r: &&usize| offsets[r] >= start && offsets[r] <= start + 2.0 * delta;
        let p =
            (of_axis.iter().filter(by_chance).count() as f64 - 0.5) / (of_axis.len() as f64 + 1.0);
        let evidence = evidence(inside.len() as f64, listed.len() as f64, p);
        let first = mean(&inside);
        let position = mean(&within(first - 1.5 * delta, first + 1.5 * delta));
        Choice { position: vec![position], score: evidence + p.ln(), evidence }
    };
    listed.iter().map(window).collect()
}

/// Whether `found` is the best option: at its position, or at that of another whose score is equal.
fn is_best(found: &[f64], options: &[Choice], tolerance: f64) -> Result<f64, String> {
    let best = options.iter().map(|o| o.score).fold(f64::NEG_INFINITY, f64::max);
    let here = |option: &&Choice| {
        option.position.iter().zip(found).all(|(a, b)| (a - b).abs() <= tolerance)
    };
    let mut same = options.iter().filter(here);
    match same.find(|option| option.score >= best - 2e-3) {
        Some(option) => Ok(option.evidence),
        None => Err(format!("{found:?} is not best ({best}) in {options:?}")),
    }
}

/// A slot may be lost only when there is no option.
fn none_left(options: &[Choice]) -> Result<f64, String> {
    if options.is_empty() { Ok(0.0) } else { Err(format!("lost, but {options:?}")) }
}

fn released(obfuscation: Obfuscation<3>) -> Released<3> {
    Released::try_new(obfuscation, 1, [0.0; 3], Unit::Meter, None).unwrap()
}

/// Random points in clusters, so that some neighbors agree and some do not.
fn points(n: usize, draws: &mut Draws) -> Vec<[f64; 3]> {
    let centers: Vec<[f64; 3]> =
        (0..9).map(|_| std::array::from_fn(|_| draws.between(-3.0, 3.0))).collect();
    (0..n).map(|i| centers[i % 9].map(|x| x + 0.2 * draws.normal())).collect()
}

/// Half of a list from the slot's own cluster, half from anywhere.
fn lists(n: usize, draws: &mut Draws) -> Neighborhoods {
    let (mut offsets, mut records) = (vec![0], Vec::new());
    for slot in 0..n {
        let mut row: Vec<u32> = Vec::new();
        while row.len() < 24 {
            let any = draws.below(n as u64) as usize;
            let record = if row.len() < 12 { any / 9 * 9 + slot % 9 } else { any };
            if record < n && record != slot && !row.contains(&(record as u32)) {
                row.push(record as u32);
            }
        }
        records.extend(row.into_iter().map(RecordId));
        offsets.push(records.len() as u64);
    }
    Neighborhoods::try_new(offsets, records, None, n, 1).unwrap()
}

const N: usize = 400;

fn check(
    what: &str,
    obfuscation: Result<Obfuscation<3>, Error>,
    delta: f64,
    judge: impl Fn(usize, &[usize], &Estimate<3>, Lists<'_>) -> Result<f64, String>,
) {
    let mut draws = Draws::new(SEED, Stage::Synthetic, 2);
    let neighborhoods = lists(N, &mut draws);
    let released = released(obfuscation.unwrap());
    let family = Family::new(&released);
    let given = Lists::given(&neighborhoods);
    let solved = solve(&family, given, delta as f32, SEED, Chunks::All);
    let mut wrong = Vec::new();
    for (slot, estimate) in solved.iter().enumerate() {
        let listed: Vec<usize> = neighborhoods.of(slot).iter().map(|r| r.index()).collect();
        match judge(slot, &listed, estimate, given) {
            Ok(evidence) if estimate.status == Status::Ok => {
                let off = (evidence - f64::from(estimate.evidence)).abs();
                assert!(off <= 1e-3 * (1.0 + evidence), "{what}: evidence is {off} off");
            }
            Ok(_) => {}
            Err(why) => wrong.push(format!("slot {slot}, {:?}: {why}", estimate.status)),
        }
    }
    // A record within rounding of delta may count in f32 and not in f64.
    assert!(wrong.len() * 200 <= N, "{what}: {} of {N} differ, {:?}", wrong.len(), wrong.first());
}

fn widen(position: &[f32; 3]) -> Vec<f64> {
    position.iter().map(|&x| f64::from(x)).collect()
}

fn lines_equal_their_twin(rows: &[Line], obfuscation: Obfuscation<3>, what: &str, delta: f64) {
    check(what, Ok(obfuscation), delta, |slot, listed, estimate, lists| {
        let may_vote = |r: RecordId| rows[slot].2.is_none() || rows[r.index()].2 != rows[slot].2;
        let null: Vec<usize> =
            draw(lists, slot, SEED, may_vote).iter().map(|r| r.index()).collect();
        let options = line_options(rows, slot, listed, &null, delta);
        if estimate.status != Status::Ok {
            return none_left(&options);
        }
        is_best(&widen(&estimate.position), &options, 1e-3 * delta)
    });
}

#[test]
fn lines_and_rays_equal_their_twin() {
    let mut draws = Draws::new(SEED, Stage::Synthetic, 1);
    let points = points(N, &mut draws);
    let directions: Vec<[f64; 3]> = points.iter().map(|_| draws.direction()).collect();
    let lines = Lines::through(&points, &directions).unwrap();
    let wide = |rows: &[[f32; 3]]| rows.iter().map(|r| r.map(f64::from)).collect::<Vec<_>>();
    let rows: Vec<Line> = wide(lines.foot())
        .into_iter()
        .zip(wide(lines.direction()))
        .map(|(foot, direction)| (foot, direction, None))
        .collect();
    for delta in [0.02, 0.1, 0.4] {
        lines_equal_their_twin(&rows, Obfuscation::Lines(lines.clone()), "lines", delta);
    }

    let centers = [[-1.5, 0.25, 0.5], [1.0, 2.0, -0.75], [4.0, -1.0, 0.0]];
    let center: Vec<u8> = points.iter().map(|_| draws.below(3) as u8).collect();
    let away: Vec<[f64; 3]> = points
        .iter()
        .zip(&center)
        .map(|(p, &c)| std::array::from_fn(|i| p[i] - centers[usize::from(c)][i]))
        .collect();
    let rays = Rays::try_new(&centers, center.clone(), &away).unwrap();
    let rows: Vec<Line> = wide(rays.direction())
        .into_iter()
        .zip(&center)
        .map(|(direction, &c)| (centers[usize::from(c)], direction, Some(c)))
        .collect();
    for delta in [0.02, 0.1, 0.4] {
        lines_equal_their_twin(&rows, Obfuscation::Rays(rays.clone()), "rays", delta);
    }
}

#[test]
fn candidates_equal_their_twin() {
    let mut draws = Draws::new(SEED, Stage::Synthetic, 3);
    let mut published = points(N, &mut draws);
    for row in &mut published {
        row[draws.below(3) as usize] = draws.between(-3.0, 3.0);
    }
    let candidates = AxisCandidates::try_new(&published).unwrap();
    let rows: Vec<[f64; 3]> = candidates.position().iter().map(|p| p.map(f64::from)).collect();
    for delta in [0.02, 0.1, 0.4] {
        let obfuscation = Obfuscation::AxisCandidates(candidates.clone());
        check("candidates", Ok(obfuscation), delta, |slot, listed, estimate, lists| {
            let null: Vec<usize> =
                draw(lists, slot, SEED, |_| true).iter().map(|r| r.index()).collect();
            let options = candidate_options(&rows, slot, listed, &null, delta);
            if estimate.status != Status::Ok {
                return none_left(&options);
            }
            is_best(&widen(&estimate.position), &options, 1e-3 * delta)
        });
    }
}

#[test]
fn planes_equal_their_twin() {
    let mut draws = Draws::new(SEED, Stage::Synthetic, 4);
    let points = points(N, &mut draws);
    let axes: Vec<u8> = points.iter().map(|_| draws.below(3) as u8).collect();
    let offset: Vec<f64> = points.iter().zip(&axes).map(|(p, &a)| p[usize::from(a)]).collect();
    let planes = AxisPlanes::<3>::try_new(axes.clone(), &offset).unwrap();
    let offsets: Vec<f64> = planes.offset().iter().map(|&x| f64::from(x)).collect();
    for delta in [0.02, 0.1, 0.4] {
        let obfuscation = Obfuscation::AxisPlanes(planes.clone());
        check("planes", Ok(obfuscation), delta, |slot, listed, estimate, _| {
            let mut evidence = 0.0;
            for axis in (0..3).filter(|&axis| axis != axes[slot]) {
                let options = window_options(&axes, &offsets, axis, listed, delta);
                if options.is_empty() {
                    let lost = estimate.status == Status::Degenerate;
                    return lost.then_some(0.0).ok_or("a missing axis is degenerate".to_owned());
                }
                let found = f64::from(estimate.position[usize::from(axis)]);
                evidence += is_best(&[found], &options, 1e-3 * delta)?;
            }
            Ok(evidence)
        });
    }
}

/// Sections of a list with a line: a kernel whose rounding could differ between instruction sets.
struct SectionBits<'a> {
    rows: &'a [crate::recover::line_rows::LineRow<3>],
    own: usize,
}

impl crate::simd::Kernel for SectionBits<'_> {
    type Output = Vec<u32>;

    #[inline(always)]
    fn run(self) -> Vec<u32> {
        let records: Vec<RecordId> = (0..self.rows.len()).map(RecordId::from_index).collect();
        let mut columns = crate::recover::line_rows::LineColumns::default();
        let mut sections = super::Sections::default();
        columns.gather(self.rows, &records);
        columns.sections(&self.rows[self.own], &mut sections);
        let columns = [&sections.at, &sections.miss2, &sections.bend];
        columns.into_iter().flatten().map(|x| x.to_bits()).collect()
    }
}

#[test]
fn instruction_sets_change_no_bit() {
    let mut draws = Draws::new(SEED, Stage::Synthetic, 5);
    let points = points(N + 3, &mut draws);
    let directions: Vec<[f64; 3]> = points.iter().map(|_| draws.direction()).collect();
    let rows =
        crate::recover::line_rows::from_lines(&Lines::through(&points, &directions).unwrap());
    for own in 0..50 {
        let portable = crate::simd::portable(SectionBits { rows: &rows, own });
        assert!(portable == crate::simd::dispatch(SectionBits { rows: &rows, own }));
    }
}
