//! The tree is compared with brute force.

use super::Knn;
use super::tree::canonical;
use crate::geometry::vector::squared_distance;
use crate::seed::{Draws, Stage};

fn brute_force<const D: usize>(
    points: &[[f64; D]],
    query: &[f64; D],
    skip: Option<usize>,
    k: usize,
) -> Vec<(f64, u32)> {
    let mut all: Vec<(f64, u32)> = (0..points.len())
        .filter(|&other| Some(other) != skip)
        .map(|other| (squared_distance(query, &points[other]), other as u32))
        .collect();
    all.sort_unstable_by_key(canonical);
    all.truncate(k);
    all
}

fn compare<const D: usize>(points: &[[f64; D]]) {
    let knn = Knn::new(points).unwrap();
    let mut found = Vec::new();
    for row in 0..points.len() {
        for k in [1, 7, 50] {
            knn.nearest(row, k, &mut found);
            assert_eq!(found, brute_force(points, &points[row], Some(row), k), "{row}, k {k}");
        }
    }
    for k in [1, 7, 50] {
        let all = knn.per_row(k, |_, found| found.to_vec());
        for (row, found) in all.iter().enumerate() {
            assert_eq!(found, &brute_force(points, &points[row], Some(row), k), "{row}, k {k}");
        }
    }
}

#[test]
fn equals_brute_force_with_many_ties() {
    let mut draws = Draws::new(5, Stage::Synthetic, 0);
    // A coarse lattice: most distances tie, many points coincide.
    let lattice: Vec<[f64; 3]> =
        (0..800).map(|_| std::array::from_fn(|_| draws.below(6) as f64)).collect();
    compare(&lattice);
}

#[test]
fn equals_brute_force_at_every_size_and_density() {
    for n in [2, 23, 24, 25, 48, 49, 97, 300, 1000] {
        let mut draws = Draws::new(n, Stage::Synthetic, 0);
        // Cubing makes the middle a million times denser than the border.
        let mut points = |_| std::array::from_fn(|_| draws.between(-1.0, 1.0).powi(3) * 1e3);
        compare(&(0..n).map(&mut points).collect::<Vec<[f64; 3]>>());
        let flat: Vec<[f64; 2]> = (0..n).map(&mut points).map(|p: [f64; 3]| [p[0], p[1]]).collect();
        compare(&flat);
    }
}

/// Depth cameras write (0, 0, 0) for missing points, so that thousands coincide.
#[test]
fn piles_are_as_if_every_point_was_looked_at() {
    let mut draws = Draws::new(3, Stage::Synthetic, 0);
    for share in [0.3, 0.9] {
        let points: Vec<[f64; 3]> = (0..900)
            .map(|row| match draws.unit() < share {
                // Zeros of both signs are equal.
                true => [if row % 2 == 0 { 0.0 } else { -0.0 }, 0.0, 0.0],
                false => std::array::from_fn(|_| draws.between(-1.0, 1.0)),
            })
            .collect();
        compare(&points);
    }
}

#[test]
fn points_at_one_place_cost_no_more_than_others() {
    let points = vec![[1.0; 3]; 200_000];
    let knn = Knn::new(&points).unwrap();
    let sums = knn.per_row(50, |_, found| found.iter().map(|item| item.1).sum::<u32>());
    assert_eq!(sums[199_999], (0..50).sum::<u32>());
    let mut found = Vec::new();
    (0..points.len()).for_each(|row| knn.nearest(row, 50, &mut found));
}

#[test]
fn any_position_can_ask() {
    let mut draws = Draws::new(9, Stage::Synthetic, 0);
    let points: Vec<[f64; 3]> = (0..700).map(|_| std::array::from_fn(|_| draws.normal())).collect();
    let knn = Knn::new(&points).unwrap();
    let mut found = Vec::new();
    for _ in 0..200 {
        let query = std::array::from_fn(|_| 3.0 * draws.normal());
        knn.nearest_to(query, 20, &mut found);
        assert_eq!(found, brute_force(&points, &query, None, 20));
    }
}

#[test]
fn values_per_row_come_in_the_order_of_rows() {
    let points = [[0.0, 0.0], [5.0, 0.0], [1.0, 0.0]];
    let knn = Knn::new(&points).unwrap();
    assert_eq!(knn.kth_distances(1), [1.0, 4.0, 1.0]);
    let mut order = knn.spatial_order().to_vec();
    order.sort_unstable();
    assert_eq!(order, [0, 1, 2]);
}

#[test]
fn no_points_and_no_numbers_are_refused() {
    assert!(Knn::<3>::new(&[]).is_err());
    assert!(Knn::new(&[[0.0, f64::NAN]]).is_err());
}
