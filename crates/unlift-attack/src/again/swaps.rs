//! Points whose coordinates were swapped in two releases.
//!
//! The two records of a point agree except in the swapped coordinates. Which of two swapped axes the point has is the same question for its
//! partner, and cycles of shared values link points (docs/decisions/again.md). So one answer decides many; the others go where points are
//! denser.

use super::Place;
use crate::geometry::knn::Knn;
use crate::geometry::vector::quantile_of;

/// Neighbors whose distance measures how dense points are.
const DENSE: usize = 8;

/// A link and the axes in which its records differ.
struct Node {
    a: [f64; 3],
    b: [f64; 3],
    axes: Vec<usize>,
    /// Whether the first release swapped the first of two axes.
    first: Option<bool>,
}

impl Node {
    fn is_end(&self) -> bool {
        self.axes.len() == 2
    }

    fn point(&self, first: bool) -> ([f64; 3], usize) {
        let axis = self.axes[usize::from(!first)];
        let mut point = self.a;
        point[axis] = self.b[axis];
        (point, axis)
    }
}

/// Nodes whose values on one axis form a cycle: the second record of each has the value of the first record of the next.
struct Cycle {
    axis: usize,
    /// [`MISSING`] for a point that only one release has, which closes a chain.
    nodes: Vec<usize>,
    values: Vec<f64>,
    /// Places of the two nodes that only one release swapped along this axis.
    ends: [usize; 2],
}

const MISSING: usize = usize::MAX;

/// Places the points of linked records `(row of a, row of b)`. `rounding` is the largest usual difference of equal coordinates.
pub(super) fn solve(
    a: &[[f64; 3]],
    b: &[[f64; 3]],
    records: &[(usize, usize)],
    rounding: f64,
) -> Vec<Place> {
    let same = same(a, b, records).max(rounding);
    let node = |&(own, other): &(usize, usize)| {
        let (a, b) = (a[own], b[other]);
        let axes = (0..3).filter(|&c| (a[c] - b[c]).abs() > same).collect();
        Node { a, b, axes, first: None }
    };
    let mut nodes: Vec<Node> = records.iter().map(node).collect();
    let cycles: Vec<Cycle> = (0..3).flat_map(|axis| cycles(&nodes, axis, same)).collect();
    // Each pair of nodes gives the same answer, or the opposite one.
    let mut equal: Vec<Vec<(usize, bool)>> = vec![Vec::new(); nodes.len()];
    for Cycle { axis, nodes: of, ends, .. } in &cycles {
        let n = of.len();
        if !n.is_multiple_of(2) {
            let left = left_in_odd(n, *ends);
            for at in ends.iter().filter(|&&at| of[at] != MISSING) {
                let node = &mut nodes[of[*at]];
                node.first = Some((node.axes[0] == *axis) != (*at == left));
            }
        } else if let [one, other] = ends.map(|at| of[at])
            && other != MISSING
        {
            let opposite = (nodes[one].axes[0] == *axis) != (nodes[other].axes[0] == *axis);
            equal[one].push((other, opposite));
            equal[other].push((one, opposite));
        }
    }
    for (values, is_second) in [(a, false), (b, true)] {
        pin(&mut nodes, values, is_second, same);
    }
    let mut decided: Vec<usize> =
        (0..nodes.len()).filter(|&at| nodes[at].first.is_some()).collect();
    while let Some(at) = decided.pop() {
        spread(&mut nodes, &equal, at, &mut decided);
    }
    let chosen = by_density(&mut nodes, &equal);
    let mut places: Vec<Place> = nodes.iter().zip(&chosen).map(place).collect();
    cycles.iter().for_each(|cycle| inner(cycle, &nodes, &mut places));
    places
}

/// Returns the largest difference of coordinates that agree; the smallest one of most records is rounding or noise.
fn same(a: &[[f64; 3]], b: &[[f64; 3]], records: &[(usize, usize)]) -> f64 {
    let least = |&(own, other): &(usize, usize)| {
        (0..3).map(|c| (a[own][c] - b[other][c]).abs()).fold(f64::INFINITY, f64::min)
    };
    10.0 * quantile_of(records.iter().map(least), 0.5)
}

/// Returns the only row of `values`, sorted with rows, within `same` of `value`.
fn lookup(values: &[(f64, usize)], value: f64, same: f64) -> Option<usize> {
    let from = values.partition_point(|one| one.0 < value - same);
    let to = values.partition_point(|one| one.0 <= value + same);
    (to == from + 1).then(|| values[from].1)
}

fn cycles(nodes: &[Node], axis: usize, same: f64) -> Vec<Cycle> {
    let differ = |at: &usize| nodes[*at].axes.len() < 3 && nodes[*at].axes.contains(&axis);
    let own: Vec<usize> = (0..nodes.len()).filter(differ).collect();
    let mut values: Vec<(f64, usize)> = own.iter().map(|&at| (nodes[at].a[axis], at)).collect();
    values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let next: Vec<Option<usize>> =
        own.iter().map(|&at| lookup(&values, nodes[at].b[axis], same)).collect();
    let next = |at: usize| own.binary_search(&at).ok().and_then(|at| next[at]);
    let mut is_head = vec![true; nodes.len()];
    own.iter().filter_map(|&at| next(at)).for_each(|at| is_head[at] = false);
    // Chains first, from their heads, so that the others are cycles.
    let starts = own.iter().filter(|at| is_head[**at]).chain(&own);
    let (mut seen, mut cycles) = (vec![false; nodes.len()], Vec::new());
    for &start in starts {
        let (mut of, mut at) = (Vec::new(), Some(start));
        while let Some(one) = at.filter(|&one| !std::mem::replace(&mut seen[one], true)) {
            of.push(one);
            at = next(one);
        }
        let Some(&last) = of.last() else { continue };
        let mut values: Vec<f64> = of.iter().map(|&at| nodes[at].a[axis]).collect();
        match at {
            Some(at) if at == start => {}
            Some(_) => continue,
            None => {
                of.push(MISSING);
                values.push(nodes[last].b[axis]);
            }
        }
        let is_end = |at: usize| at == MISSING || nodes[at].is_end();
        let ends: Vec<usize> = (0..of.len()).filter(|&k| is_end(of[k])).collect();
        if let &[one, other] = ends.as_slice() {
            // The ends are opposite in an even cycle, and nearly so in an odd one.
            let (n, apart) = (of.len(), other - one);
            if apart == n / 2 || apart == n.div_ceil(2) {
                cycles.push(Cycle { axis, nodes: of, values, ends: [one, other] });
            }
        }
    }
    cycles
}

/// Returns the end of an odd cycle that the first release left: the other one is half a cycle before it.
fn left_in_odd(n: usize, [one, other]: [usize; 2]) -> usize {
    if (one + n - n.div_ceil(2)) % n == other { one } else { other }
}

/// Decides nodes of which only one answer is possible, because a release with a swap also has the value of the partner.
fn pin(nodes: &mut [Node], released: &[[f64; 3]], is_second: bool, same: f64) {
    let values = [0, 1, 2].map(|axis| {
        let mut values: Vec<f64> = released.iter().map(|p| p[axis]).collect();
        values.sort_unstable_by(f64::total_cmp);
        values
    });
    for node in nodes.iter_mut().filter(|node| node.is_end()) {
        for (at, &axis) in node.axes.iter().enumerate() {
            let value = if is_second { node.a[axis] } else { node.b[axis] };
            let from = values[axis].partition_point(|&one| one < value - same);
            let has = values[axis].get(from).is_some_and(|&one| one <= value + same);
            if !has {
                // This release did not swap this axis.
                node.first = Some((at == 0) == is_second);
            }
        }
    }
}

/// Decides the open nodes that depend directly on the decided node `at`, and adds them to `decided`.
fn spread(nodes: &mut [Node], equal: &[Vec<(usize, bool)>], at: usize, decided: &mut Vec<usize>) {
    let Some(first) = nodes[at].first else { return };
    for &(other, opposite) in &equal[at] {
        if nodes[other].first.is_none() {
            nodes[other].first = Some(first != opposite);
            decided.push(other);
        }
    }
}

/// Decides the other nodes, those that depend on each other together, and returns the probability of each answer.
fn by_density(nodes: &mut [Node], equal: &[Vec<(usize, bool)>]) -> Vec<f64> {
    let mut chosen = vec![1.0; nodes.len()];
    let open = |node: &Node| node.is_end() && node.first.is_none();
    let both = |node: &Node| [true, false].map(|first| node.point(first).0);
    let answers = nodes.iter().filter(|node| node.is_end()).flat_map(|node| match node.first {
        Some(first) => vec![node.point(first).0],
        None => both(node).to_vec(),
    });
    let points: Vec<[f64; 3]> = answers.collect();
    let Ok(knn) = Knn::new(&points) else { return chosen };
    let mut found = Vec::new();
    let mut sparse = |point: [f64; 3]| {
        knn.nearest_to(point, DENSE.min(points.len()), &mut found);
        found.last().map_or(0.0, |last| libm::log(last.0.max(f64::MIN_POSITIVE)))
    };
    for root in 0..nodes.len() {
        if !open(&nodes[root]) {
            continue;
        }
        nodes[root].first = Some(true);
        let (mut group, mut at) = (vec![root], 0);
        while at < group.len() {
            spread(nodes, equal, group[at], &mut group);
            at += 1;
        }
        let gain = |&at: &usize| {
            let (node, first) = (&nodes[at], nodes[at].first == Some(true));
            sparse(node.point(!first).0) - sparse(node.point(first).0)
        };
        let gains: f64 = group.iter().map(gain).sum();
        for &at in &group {
            nodes[at].first = nodes[at].first.map(|first| first == (gains >= 0.0));
            chosen[at] = 1.0 / (1.0 + libm::exp(-gains.abs()));
        }
    }
    chosen
}

fn place((node, chosen): (&Node, &f64)) -> Place {
    match (node.axes.as_slice(), node.first) {
        (_, Some(first)) => {
            let (point, axis) = node.point(first);
            Place { chosen: *chosen, ..Place::at(point, axis) }
        }
        // Swapped along one axis in both releases: a line, unless a cycle tells more.
        (&[axis], _) => Place::guess(node.a, axis),
        // No coordinate was swapped, or the records are not of one point.
        ([], _) => Place::at(node.a, 0),
        _ => Place { is_linked: false, ..Place::NONE },
    }
}

/// Places the nodes of a cycle that both releases swapped along its axis.
fn inner(Cycle { axis, nodes: of, values, ends }: &Cycle, nodes: &[Node], places: &mut [Place]) {
    let n = of.len();
    let Some(node) = nodes.get(of[ends[0]]) else { return };
    let is_left = node.first.is_some_and(|first| node.axes[usize::from(!first)] != *axis);
    // The first release pairs places whose sum is this.
    let sum = match n.is_multiple_of(2) {
        true => 2 * ends[0] + usize::from(!is_left),
        false => 2 * left_in_odd(n, *ends),
    };
    for (k, &at) in of.iter().enumerate() {
        if nodes.get(at).is_some_and(|node| node.axes.len() == 1) {
            let mut point = nodes[at].a;
            point[*axis] = values[(sum % n + n - k) % n];
            places[at] = Place::at(point, *axis);
        }
    }
}
