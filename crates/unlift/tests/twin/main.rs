//! Comparison of consensus with a brute-force version in `f64` that tries every interval and
//! window. Both share only the chance of a place, which is part of the model.

mod brute;

use brute::{Choice, Line, candidate_options, line_options, window_options};
use unlift::neighbors::Neighborhoods;
use unlift::recover::{Builtin, Delta, RecoverOptions, Recovered, Status, chance, recover};
use unlift::released::{AxisCandidates, AxisPlanes, Lines, Obfuscation, Rays, Released};
use unlift::seed::{Draws, Stage};
use unlift::{Error, RecordId, Unit};

const SEED: u64 = 5;

/// Returns the evidence of the candidate at `found` if its score is the best one. Otherwise returns an
/// error.
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

/// Checks that a lost slot has no candidate. Returns its evidence, 0.
fn none_left(options: &[Choice]) -> Result<f64, String> {
    if options.is_empty() { Ok(0.0) } else { Err(format!("lost, but {options:?}")) }
}

fn released(obfuscation: Obfuscation<3>) -> Released<3> {
    Released::try_new(obfuscation, 1, [0.0; 3], Unit::Meter, None).unwrap()
}

/// Returns random points in clusters, so that some neighbors agree and some do not.
fn points(n: usize, draws: &mut Draws) -> Vec<[f64; 3]> {
    let centers: Vec<[f64; 3]> =
        (0..9).map(|_| std::array::from_fn(|_| draws.between(-3.0, 3.0))).collect();
    (0..n).map(|i| centers[i % 9].map(|x| x + 0.2 * draws.normal())).collect()
}

/// Returns lists with half of the entries from the slot's own cluster and half from anywhere.
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

/// The chance at a place, for slots of a center.
type Chance<'a> = dyn Fn(usize, &[f64; 3]) -> f64 + 'a;

fn check(
    what: &str,
    obfuscation: Result<Obfuscation<3>, Error>,
    delta: f64,
    judge: impl Fn(usize, &[usize], &Recovered<3>, &Chance<'_>) -> Result<f64, String>,
) {
    let mut draws = Draws::new(SEED, Stage::Synthetic, 2);
    let neighborhoods = lists(N, &mut draws);
    let released = released(obfuscation.unwrap());
    let options = RecoverOptions {
        delta: Delta::Fixed(delta),
        // Only votes are compared.
        exact_constraints: false,
        confidence: false,
        ..RecoverOptions::default()
    };
    let learned = chance(&released, &neighborhoods);
    let chance = |group: usize, x: &[f64; 3]| {
        let x = x.map(|x| x as f32);
        f64::from(learned(group, &x, delta as f32).expect("chance is a field"))
    };
    let solved = recover(&released, &neighborhoods, &Builtin::Consensus, &options).unwrap();
    let mut wrong = Vec::new();
    for slot in 0..N {
        let listed: Vec<usize> = neighborhoods.of(slot).iter().map(|r| r.index()).collect();
        let (status, found) = (solved.status()[slot], f64::from(solved.evidence()[slot]));
        match judge(slot, &listed, &solved, &chance) {
            Ok(evidence) if status == Status::Ok => {
                let off = (evidence - found).abs();
                assert!(off <= 1e-3 * (1.0 + evidence), "{what}: evidence is {off} off");
            }
            Ok(_) => {}
            Err(why) => wrong.push(format!("slot {slot}, {status:?}: {why}")),
        }
    }
    // A record at a distance of almost delta may count in `f32` and not in `f64`.
    assert!(wrong.len() * 200 <= N, "{what}: {} of {N} differ, {:?}", wrong.len(), wrong.first());
}

fn widen(position: &[f32; 3]) -> Vec<f64> {
    position.iter().map(|&x| f64::from(x)).collect()
}

fn lines_equal_their_twin(rows: &[Line], obfuscation: Obfuscation<3>, what: &str, delta: f64) {
    check(what, Ok(obfuscation), delta, |slot, listed, solved, chance| {
        let group = usize::from(rows[slot].2.unwrap_or(0));
        let chance = |x: &[f64; 3]| chance(group, x);
        let options = line_options(rows, slot, listed, delta, chance);
        if solved.status()[slot] != Status::Ok {
            return none_left(&options);
        }
        is_best(&widen(&solved.positions()[slot]), &options, 1e-3 * delta)
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
        check("candidates", Ok(obfuscation), delta, |slot, listed, solved, chance| {
            let chance = |x: &[f64; 3]| chance(0, x);
            let options = candidate_options(&rows, slot, listed, delta, chance);
            if solved.status()[slot] != Status::Ok {
                return none_left(&options);
            }
            is_best(&widen(&solved.positions()[slot]), &options, 1e-3 * delta)
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
        check("planes", Ok(obfuscation), delta, |slot, listed, solved, _| {
            let mut evidence = 0.0;
            for axis in (0..3).filter(|&axis| axis != axes[slot]) {
                let options = window_options(&axes, &offsets, axis, listed, delta);
                if options.is_empty() {
                    let lost = solved.status()[slot] == Status::Degenerate;
                    return lost.then_some(0.0).ok_or("a missing axis is degenerate".to_owned());
                }
                let found = f64::from(solved.positions()[slot][usize::from(axis)]);
                evidence += is_best(&[found], &options, 1e-3 * delta)?;
            }
            Ok(evidence)
        });
    }
}
