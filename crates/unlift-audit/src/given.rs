//! Neighborhoods by point, from a file of the owner.

use std::path::Path;

use unlift::audit::PointNeighbors;
use unlift::geometry::vector::distance;
use unlift_io::stage::read_point_neighborhoods;

use crate::Error;
use crate::prepare::Prepared;

/// Reads lists by row of the file and keeps those of the prepared rows.
///
/// `n_read` rows were read from the file of the map. Doubts about the lists are added to `notes`.
///
/// # Errors
/// If the file cannot be read, or has another number of rows.
pub fn by_point(
    path: &Path,
    prepared: &Prepared,
    n_read: usize,
    notes: &mut Vec<String>,
) -> Result<PointNeighbors, Error> {
    let lists = read_point_neighborhoods(path, n_read)?;
    let mut kept_as = vec![None; n_read];
    for (kept, &row) in prepared.rows.iter().enumerate() {
        kept_as[row as usize] = Some(kept as u32);
    }
    let (mut offsets, mut neighbors) = (vec![0u64], Vec::new());
    let mut scores = lists.scores().map(|_| Vec::new());
    for &row in &prepared.rows {
        let start = lists.offsets()[row as usize] as usize;
        for (at, &neighbor) in lists.of(row as usize).iter().enumerate() {
            if let Some(kept) = kept_as[neighbor as usize] {
                neighbors.push(kept);
                if let (Some(scores), Some(all)) = (&mut scores, lists.scores()) {
                    scores.push(all[start + at]);
                }
            }
        }
        offsets.push(neighbors.len() as u64);
    }
    notes.extend(doubts(&offsets, &neighbors, prepared));
    // The hashes identify the file; a file called oracle must not appear as the source `oracle`.
    let name = "file".to_owned();
    Ok(PointNeighbors { name, offsets, neighbors, scores })
}

/// Returns doubts about given lists. With lists of another map little is recovered, which would
/// look like protection.
fn doubts(offsets: &[u64], neighbors: &[u32], prepared: &Prepared) -> Vec<String> {
    let points = prepared.original.reveal().positions();
    let mut doubts = Vec::new();
    let empty = offsets.windows(2).filter(|w| w[0] == w[1]).count();
    if empty > 0 {
        let n = points.len();
        doubts.push(format!(
            "lists: {empty} of {n} points have no neighbors in the file, and count as lost"
        ));
    }
    let (mut nearer, mut n) = (0usize, 0usize);
    for (point, w) in offsets.windows(2).enumerate() {
        for &neighbor in &neighbors[w[0] as usize..w[1] as usize] {
            // A large odd factor spreads the compared points over the map.
            let stranger = (n * 7919 + 3) % points.len();
            let to = |other: usize| distance(&points[point], &points[other]);
            nearer += usize::from(to(neighbor as usize) < to(stranger));
            n += 1;
        }
    }
    // Of random points half are nearer; two standard deviations are added.
    if n > 0 && nearer as f64 <= 0.5 * n as f64 + (n as f64).sqrt() {
        doubts.push(format!(
            "lists: the neighbors in the file are no nearer than random points ({nearer} of {n}): check that they are \
             of this map and in its order of rows"
        ));
    }
    doubts
}

#[cfg(test)]
mod tests {
    use super::*;
    use unlift::truth::Original;
    use unlift::{PointSet, Unit};

    /// Lists the next few of 200 points on a line; with a factor other than 1, other points.
    fn doubts_about(factor: usize, length: usize) -> Vec<String> {
        let n = 200;
        let points = (0..n).map(|i| [0.1 * i as f64, 0.0, 0.0]).collect();
        let points = PointSet::try_new(points, Unit::Meter).unwrap();
        let prepared = Prepared::of(Original::new(points));
        let offsets: Vec<u64> = (0..=n).map(|point| (point * length) as u64).collect();
        let row = |point: usize| (1..=length).map(move |step| (point * factor + step) % n);
        let neighbors: Vec<u32> = (0..n).flat_map(row).map(|other| other as u32).collect();
        doubts(&offsets, &neighbors, &prepared)
    }

    #[test]
    fn lists_that_cannot_be_of_the_map_are_doubted() {
        assert!(doubts_about(1, 5).is_empty());
        let of_another = doubts_about(77, 5);
        assert_eq!(of_another.len(), 1);
        assert!(of_another[0].starts_with("lists: the neighbors in the file are no nearer than"));
        let empty = doubts_about(1, 0);
        assert_eq!(
            empty,
            ["lists: 200 of 200 points have no neighbors in the file, and count as lost"]
        );
    }
}
