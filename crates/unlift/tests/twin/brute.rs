//! Brute-force consensus: all candidate positions of a slot with their scores.

/// A candidate position and its score.
#[derive(Debug)]
pub(super) struct Choice {
    pub(super) position: Vec<f64>,
    pub(super) score: f64,
    pub(super) evidence: f64,
}

/// Returns `k KL(n / k || p)` nats if above chance, else 0.
pub(super) fn evidence(n: f64, k: f64, p: f64) -> f64 {
    let term = |hits: f64, chance: f64| {
        if hits == 0.0 { 0.0 } else { hits * (hits / (k * chance)).ln() }
    };
    if n <= p * k { 0.0 } else { term(n, p) + term(k - n, 1.0 - p) }
}

/// The vote of a record along a feasible line: its squared distance to the point at `t`.
pub(super) struct Vote {
    /// For each line: squared distance at the closest approach, parameter of this point, and growth
    /// of the distance.
    terms: Vec<(f64, f64, f64)>,
}

impl Vote {
    fn squared_distance(&self, t: f64) -> f64 {
        let at = |&(miss2, at, bend): &(f64, f64, f64)| miss2 + bend * (t - at) * (t - at);
        self.terms.iter().map(at).fold(f64::INFINITY, f64::min)
    }

    /// Returns true if the record agrees with every position.
    fn is_everywhere(&self, delta: f64) -> bool {
        self.terms.iter().any(|&(miss2, _, bend)| bend == 0.0 && miss2 <= delta * delta)
    }

    /// Returns the start of the interval in which the vote counts, if it does not count everywhere.
    fn start(&self, delta: f64) -> Option<f64> {
        if self.is_everywhere(delta) {
            return None;
        }
        let crossing = |&&(miss2, _, bend): &&(f64, f64, f64)| bend > 0.0 && miss2 <= delta * delta;
        let start =
            |&(miss2, at, bend): &(f64, f64, f64)| at - ((delta * delta - miss2) / bend).sqrt();
        self.terms.iter().filter(crossing).map(start).reduce(f64::min)
    }

    /// Returns place and weight for a refit; 0 if the record agrees with every position.
    fn refit_term(&self, t: f64, delta: f64) -> (f64, f64) {
        if self.is_everywhere(delta) {
            return (0.0, 0.0);
        }
        let distance = |&(miss2, at, bend): &(f64, f64, f64)| miss2 + bend * (t - at) * (t - at);
        let best = self.terms.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        best.map_or((0.0, 0.0), |&(_, at, bend)| (at, bend))
    }
}

/// Returns every start of an interval with its score and refitted position.
pub(super) fn options_along(
    listed: &[Vote],
    k: usize,
    delta: f64,
    floor: f64,
    at: impl Fn(f64) -> [f64; 3],
    chance: impl Fn(&[f64; 3]) -> f64,
) -> Vec<Choice> {
    // A start must count for its own interval despite rounding of the square root.
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
            let p = chance(&at(t));
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
            Choice { position: at(t.max(floor)).to_vec(), score, evidence }
        })
        .collect()
}

/// A line or ray in `f64`: point, direction, group.
pub(super) type Line = ([f64; 3], [f64; 3], Option<u8>);

/// Returns the vote of `other` along `own`; `None` if it has none.
pub(super) fn section(own: &Line, other: &Line) -> Option<Vote> {
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

/// Returns the candidates of a slot on `own` for its listed lines and the chance of a place.
pub(super) fn line_options(
    rows: &[Line],
    own: usize,
    listed: &[usize],
    delta: f64,
    chance: impl Fn(&[f64; 3]) -> f64,
) -> Vec<Choice> {
    let own = &rows[own];
    let may_vote = |&&other: &&usize| own.2.is_none() || rows[other].2 != own.2;
    let k = listed.iter().filter(may_vote).count();
    let floor = if own.2.is_some() { 0.0 } else { f64::NEG_INFINITY };
    let votes_of_listed: Vec<Vote> =
        listed.iter().filter_map(|&other| section(own, &rows[other])).collect();
    if votes_of_listed.len() < 2 {
        return Vec::new();
    }
    let at = |t: f64| std::array::from_fn(|c| own.0[c] + t * own.1[c]);
    options_along(&votes_of_listed, k, delta, floor, at, chance)
}

/// Returns the candidates of an axis candidate: each own axis with all lines of every record.
pub(super) fn candidate_options(
    rows: &[[f64; 3]],
    own: usize,
    listed: &[usize],
    delta: f64,
    chance: impl Fn(&[f64; 3]) -> f64,
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
        let votes: Vec<Vote> = listed.iter().map(vote).collect();
        let at = |t: f64| std::array::from_fn(|c| if c == axis { t } else { p[c] });
        let none = f64::NEG_INFINITY;
        options.extend(options_along(&votes, listed.len(), delta, none, at, &chance));
    }
    options
}

/// Returns the candidates of one free axis of a plane: every window that starts at a listed offset.
/// The position is this coordinate only.
pub(super) fn window_options(
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
