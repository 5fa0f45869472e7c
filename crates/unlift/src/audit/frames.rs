//! Doubts about two maps that are not of one place, or not in one frame.

use crate::geometry::knn::Knn;
use crate::geometry::vector::{distance, median};
use crate::localization::{Unit32, mutual};
use crate::truth::Original;
use crate::{Descriptors, Error};

/// The points of a map and their descriptors.
pub type Described<'a> = (&'a Original<3>, Option<&'a Descriptors>);

const SAMPLE: usize = 500;
/// Places are equal within the median distance to this neighbor.
const NEIGHBOR: usize = 10;
/// Fewest matches that tell frames apart.
const FEWEST: usize = 12;

/// Returns a doubt if the maps are not in one frame, or do not show one place.
///
/// # Errors
/// If the second map has no points.
pub fn doubt_of_frames(
    (a, of_a): Described<'_>,
    (b, of_b): Described<'_>,
) -> Result<Option<String>, Error> {
    let [a, b] = [a, b].map(|map| map.reveal().positions());
    let rows: Vec<usize> = (0..a.len()).step_by(a.len().div_ceil(SAMPLE).max(1)).collect();
    let knn = Knn::new(b)?;
    let near = median(&mut knn.kth_distances(NEIGHBOR.min(b.len() - 1)));
    let pairs: Vec<[[f64; 3]; 2]> = match (of_a, of_b) {
        (Some(of_a), Some(of_b)) if of_a.dim() == of_b.dim() => {
            let of_a = Unit32::of(of_a, rows.iter().copied());
            let pairs = mutual(&of_a, &Unit32::of(of_b, 0..b.len()));
            pairs.into_iter().map(|(i, j)| [a[rows[i]], b[j]]).collect()
        }
        _ => Vec::new(),
    };
    if pairs.len() < FEWEST {
        let n = rows.iter().filter(|row| knn.nearest_within(a[**row], near).is_some()).count();
        let message = format!(
            "second map: near {n} of {} points of the first one: in another frame?",
            rows.len()
        );
        return Ok((3 * n < rows.len()).then_some(message));
    }
    let (same, of) = (pairs.iter().filter(|[p, q]| distance(p, q) <= near).count(), pairs.len());
    let message = format!(
        "second map: {same} of {of} points with similar descriptors are at one place: both must be of one place, in one frame and \
         scale"
    );
    Ok((2 * same < of).then_some(message))
}
