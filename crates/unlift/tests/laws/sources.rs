//! Properties of all sources that compare descriptors, and of each source's purpose.

use unlift::audit::doubts::exchanged;
use unlift::audit::measure;
use unlift::neighbors::sources::SOURCES;
use unlift::neighbors::{Needs, Overlap, Similarity, Source};

use crate::maps::*;

/// Synthetic image patch around a keypoint: gradients, each with a place and a direction.
struct Picture(Vec<([f64; 2], f64)>);

impl Picture {
    fn random(item: u64) -> Self {
        let mut draws = Draws::new(3, Stage::Synthetic, item);
        let mut blob = || {
            let place = [draws.between(-5.0, 5.0), draws.between(-5.0, 5.0)];
            (place, draws.between(0.0, std::f64::consts::TAU))
        };
        Self((0..24).map(|_| blob()).collect())
    }

    /// Returns a SIFT-like descriptor of the patch after rotation (from x towards y) and shift.
    fn descriptor(&self, degrees: f64, shift: [f64; 2]) -> Vec<u8> {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let mut squares = Vec::new();
        for cell in 0..16 {
            let place = [f64::from(cell % 4) - 1.5, f64::from(cell / 4) - 1.5];
            for bin in 0..8 {
                let mut sum = 1e-4;
                for (at, angle) in &self.0 {
                    let x = cos * at[0] - sin * at[1] + shift[0] - place[0];
                    let y = sin * at[0] + cos * at[1] + shift[1] - place[1];
                    let turned =
                        angle + degrees.to_radians() + f64::from(bin) * std::f64::consts::FRAC_PI_4;
                    sum += (-(x * x + y * y)).exp() * (2.0 * turned.cos()).exp();
                }
                squares.push(sum);
            }
        }
        let total: f64 = squares.iter().sum();
        squares.iter().map(|s| (512.0 * (s / total).sqrt()).round().min(255.0) as u8).collect()
    }
}

/// Returns arbitrary lines with the given descriptors.
fn released(rows: &[Vec<u8>], slots_per_record: usize) -> Released<3> {
    let n = rows.len() / slots_per_record;
    let points: Vec<[f64; 3]> = (0..n).map(|i| [i as f64, 0.0, (i % 7) as f64]).collect();
    let lines = Lines::through(&points, &vec![[0.0, 1.0, 0.5]; n]).unwrap();
    let descriptors = Descriptors::try_new(Values::U8(rows.concat()), rows[0].len()).unwrap();
    let obfuscation = Obfuscation::Lines(lines);
    Released::try_new(obfuscation, slots_per_record, [0.0; 3], Unit::Meter, Some(descriptors))
        .unwrap()
}

fn random_map(n: usize) -> Vec<Vec<u8>> {
    (0..n as u64).map(|item| Picture::random(item).descriptor(0.0, [0.0; 2])).collect()
}

fn best(lists: &Neighborhoods, slot: usize) -> RecordId {
    let scores = lists.scores_of(slot).expect("scores");
    let at = (0..scores.len()).max_by(|&a, &b| scores[a].total_cmp(&scores[b])).expect("a list");
    lists.of(slot)[at]
}

#[test]
fn a_patch_that_is_turned_or_shifted_is_found_again() {
    let mut rows = random_map(300);
    let changes = [
        (45.0, [0.0, 0.0]),
        (135.0, [0.0, 0.0]),
        (90.0, [1.0, 0.0]),
        (180.0, [-1.0, 1.0]),
        (0.0, [0.0, 2.0]),
    ];
    for (item, (degrees, shift)) in changes.into_iter().enumerate() {
        rows.push(Picture::random(item as u64).descriptor(degrees, shift));
    }
    let map = released(&rows, 1);
    let lists = Overlap.lists(&map, 5, 0).unwrap();
    for (item, change) in changes.iter().enumerate() {
        assert_eq!(best(&lists, item), RecordId(300 + item as u32), "{change:?}");
        assert_eq!(best(&lists, 300 + item), RecordId(item as u32), "{change:?}");
    }
    // `similarity` fails for all but the smallest rotation or shift, so the test can fail.
    let plain = Similarity.lists(&map, 5, 0).unwrap();
    let found = (0..changes.len()).filter(|&i| best(&plain, i) == RecordId(300 + i as u32)).count();
    assert!(found < changes.len(), "{found}");
}

#[test]
fn similarity_is_the_cosine() {
    let rows = random_map(150);
    let lists = Similarity.lists(&released(&rows, 1), 10, 0).unwrap();
    let cosine = |a: &[u8], b: &[u8]| {
        let dot = |a: &[u8], b: &[u8]| -> f64 {
            a.iter().zip(b).map(|(&x, &y)| f64::from(x) * f64::from(y)).sum()
        };
        dot(a, b) / (dot(a, a) * dot(b, b)).sqrt()
    };
    for slot in [0, 77, 149] {
        let cosine = |other: u32| cosine(&rows[slot], &rows[other as usize]);
        let mut nearest: Vec<u32> = (0..150).filter(|&other| other as usize != slot).collect();
        nearest.sort_by(|&a, &b| cosine(b).total_cmp(&cosine(a)));
        let mut nearest: Vec<RecordId> = nearest[..10].iter().map(|&id| RecordId(id)).collect();
        nearest.sort_unstable();
        assert_eq!(lists.of(slot), nearest);
        for (record, score) in lists.of(slot).iter().zip(lists.scores_of(slot).unwrap()) {
            // Scores are sums of 128 products in `f32`.
            assert!((f64::from(*score) - cosine(record.0)).abs() < 1e-5);
        }
    }
}

/// Returns all sources that compare descriptors. Sources from records alone are tested in `alone`.
fn sources() -> impl Iterator<Item = Arc<dyn Source<3>>> {
    let sources = SOURCES.iter().map(|entry| source::<3>(entry.name));
    sources.filter(|source| source.needs() != Needs::Nothing)
}

#[test]
fn permuting_records_permutes_lists() {
    let rows = random_map(260);
    let order = Draws::new(5, Stage::Synthetic, 0).permutation(260);
    let permuted: Vec<Vec<u8>> = order.iter().map(|&at| rows[at as usize].clone()).collect();
    let listed = |lists: &Neighborhoods, slot: usize, name: &dyn Fn(u32) -> u32| {
        let records = lists.of(slot).iter().map(|record| name(record.0));
        let mut row: Vec<_> = records.zip(lists.scores_of(slot).unwrap().to_vec()).collect();
        row.sort_unstable_by_key(|&(record, _)| record);
        row
    };
    for source in sources() {
        let plain = source.lists(&released(&rows, 1), 6, 0).unwrap();
        let other = source.lists(&released(&permuted, 1), 6, 0).unwrap();
        for (slot, &was) in order.iter().enumerate() {
            let found = listed(&other, slot, &|record| order[record as usize]);
            assert_eq!(found, listed(&plain, was as usize, &|record| record), "{}", source.name());
        }
    }
}

#[test]
fn what_cannot_be_compared_is_told_in_one_line() {
    let map = released(&random_map(9), 1);
    let short = released(&[vec![1, 2, 3], vec![3, 2, 1], vec![0, 1, 0]], 1);
    let bare = released_of(&short, short.obfuscation().clone());
    for (map, name, k, message) in [
        (&map, "overlap", 9, "k: expected between 1 and 8 (other records), found 9"),
        (&short, "overlap", 1, "(128 values each, none negative), found 3 values each"),
        (&bare, "similarity", 1, "expected descriptors, which this source compares, found none"),
    ] {
        let error = source::<3>(name).lists(map, k, 0).unwrap_err().to_string();
        assert!(error.starts_with(name) && error.ends_with(message), "{error}");
    }
}

#[test]
fn blank_and_equal_descriptors_are_no_trouble() {
    let mut rows = random_map(40);
    rows[3] = vec![0; 128];
    rows[7] = rows[8].clone();
    for source in sources() {
        let lists = source.lists(&released(&rows, 1), 6, 0).unwrap();
        assert!(lists.scores().unwrap().iter().all(|score| score.is_finite()));
        assert!(lists.of(7).contains(&RecordId(8)), "{}", source.name());
        assert!(lists.of(3).is_empty() && !lists.records().contains(&RecordId(3)));
    }
}

/// Every second point of paired lines has no list, as if its descriptor were dropped.
#[test]
fn points_without_a_list_are_placed_by_the_records() {
    let hidden = hide::<3>(entry("ppl"), &synthetic::room(1, 2000).points, 1);
    let all = hidden.lists(20, 1.0, 0);
    let (mut offsets, mut records) = (vec![0], Vec::new());
    for slot in 0..all.n_slots() {
        let list = if slot % 2 == 0 { all.of(slot) } else { &[] };
        records.extend_from_slice(list);
        offsets.push(records.len() as u64);
    }
    let scores = Some(vec![0.0; records.len()]);
    let n_records = hidden.released.n_records();
    let lists = Neighborhoods::try_new(offsets, records, scores, n_records, 2).unwrap();
    let lists = lists.with_about(About { by_oracle: false, ..all.about() });
    let recovered = solve(&hidden.released, &lists, joint());
    assert!(recovered.status().iter().all(|&status| status == Status::Ok));
    let percent = hidden.percent_within(&recovered, 0.25);
    assert!(percent > 60.0, "{percent}");
}

/// Lists of points, as sources make them from descriptors, name a point of a line; lists of lines leave open which of the two is meant.
#[test]
fn lists_that_name_points_recover_more_than_lists_of_lines() {
    let points = synthetic::room(1, 3000).points;
    let hidden = hide::<3>(entry("ppl"), &points, 1);
    let (search, mut draws) = (Knn::new(&points).unwrap(), Draws::new(2, Stage::Synthetic, 0));
    let (mut offsets, mut neighbors, mut near) = (vec![0], Vec::new(), Vec::new());
    for point in 0..points.len() {
        search.nearest(point, 30, &mut near);
        // One of eight entries is right.
        neighbors.extend(near.iter().map(|&(_, near)| match draws.unit() < 0.125 {
            true => near,
            false => draws.below(points.len() as u64) as u32,
        }));
        offsets.push(neighbors.len() as u64);
    }
    let scores: Vec<f32> = neighbors.iter().map(|_| draws.unit() as f32).collect();
    let named = oracle::from_points(&offsets, &neighbors, Some(&scores), &hidden.secret).unwrap();
    let (offsets, records) = (named.offsets().to_vec(), named.records().to_vec());
    let scores = named.scores().map(<[f32]>::to_vec);
    let n_records = hidden.released.n_records();
    let of_lines = Neighborhoods::try_new(offsets, records, scores, n_records, 2).unwrap();
    let percent = |lists: &Neighborhoods| {
        hidden.percent_within(&solve(&hidden.released, lists, joint()), 0.1)
    };
    let [points, lines] = [percent(&named), percent(&of_lines.with_about(named.about()))];
    assert!(points > lines + 5.0, "{points} and {lines}");
}

/// If descriptor rows of the truth are wrong, points come back at the other point of their line.
#[test]
fn wrong_descriptor_rows_are_told() {
    let scheme = entry("ppl").of_dimension::<3>(&SchemeOptions { voxel: 0.5 }).unwrap();
    let (original, released, secret) = unlift_testkit::described_map(&*scheme, 600);
    let back = solve(&released, &Overlap.lists(&released, 20, 0).unwrap(), joint());
    let turned = secret.descriptor_row().iter().map(|row| row ^ 1).collect();
    let hidden = secret.hidden().to_vec();
    let wrong = Secret::try_new(hidden, None, turned, Vec::new(), 600, 2).unwrap();
    let thresholds = Plan::<3>::new(Unit::Meter).thresholds;
    let doubt =
        |secret| exchanged(&measure(&back, &original, secret, None, &thresholds).unwrap().0);
    assert_eq!(doubt(&secret), None);
    assert!(doubt(&wrong).unwrap().contains("at the other point of their line"));
}

/// Lists must state their map and row order, because positions depend on both.
#[test]
fn lists_say_what_they_are_about() {
    for slots_per_record in [1, 2] {
        let map = released(&random_map(200), slots_per_record);
        for name in SOURCES.iter().map(|entry| entry.name) {
            let about = source::<3>(name).lists(&map, 6, 0).unwrap().about();
            assert_eq!(about.map, Some(map.fingerprint()), "{name}");
            let by_rows = name != "geometric";
            let order = if by_rows { RowOrder::DescriptorRows } else { RowOrder::Either };
            assert_eq!(about.order, order, "{name}");
        }
    }
}

/// Returns true neighbors for a small K, of a room with paired lines.
fn near(k: usize) -> TrueNeighbors {
    hide::<3>(entry("ppl"), &synthetic::room(2, 120).points, 1).near(k)
}

#[test]
fn a_ratio_above_zero_is_not_zero() {
    let near = near(4);
    let measured =
        |ratio| near.measured_inlier_ratio(&near.lists(ratio, &Outliers::Uniform, 1).unwrap());
    assert_eq!([0.0, 0.05, 0.1, 0.25, 0.5].map(measured), [0.0, 0.25, 0.25, 0.25, 0.5]);
}

/// If the order of lists is unknown, the better one counts, or half would count as wrong.
#[test]
fn the_ratio_of_lists_in_either_order_is_that_of_the_better_one() {
    let near = near(9);
    let lists = near.lists(1.0, &Outliers::Uniform, 1).unwrap();
    let row = |slot: usize| lists.of(slot ^ 1).iter().map(|record| record.0).collect();
    let rows: Vec<_> = (0..lists.n_slots()).map(row).collect();
    let turned = lists_of(&rows, lists.n_slots() / 2, 2);
    let measured = |order| {
        let about = About { order, ..lists.about() };
        near.measured_inlier_ratio(&turned.clone().with_about(about))
    };
    assert!(measured(RowOrder::Slots) < 0.9);
    assert_eq!(measured(RowOrder::Either), 1.0);
}
