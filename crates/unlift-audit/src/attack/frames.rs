//! Whether two maps of one place are in one frame.

use unlift::geometry::knn::Knn;
use unlift::geometry::vector::{along, cross, distance, dot, median, sub};
use unlift::seed::{Draws, Stage};

use crate::Error;
use crate::doubts::{nearest_to, short};
use crate::localization::matches::{Unit32, mutual};
use crate::maps::Prepared;

const SAMPLE: usize = 500;
/// Places are equal within the median distance to this neighbor.
const NEIGHBOR: usize = 10;
/// Fewest matches that tell frames apart.
const FEWEST: usize = 12;
const TRIES: usize = 300;

/// Returns a doubt if the maps are not in one frame, or do not show one place.
pub fn doubt_of_frames(first: &Prepared, second: &Prepared) -> Result<Option<String>, Error> {
    let (a, b) = (first.original.reveal().positions(), second.original.reveal().positions());
    let rows: Vec<usize> = (0..a.len()).step_by(a.len().div_ceil(SAMPLE).max(1)).collect();
    let knn = Knn::new(b)?;
    let near = median(&mut knn.kth_distances(NEIGHBOR.min(b.len() - 1)));
    let pairs: Vec<[[f64; 3]; 2]> = match (&first.descriptors, &second.descriptors) {
        (Some(of_a), Some(of_b)) if of_a.dim() == of_b.dim() => {
            let of_a = Unit32::of(of_a, rows.iter().copied());
            let pairs = mutual(&of_a, &Unit32::of(of_b, 0..b.len()));
            pairs.into_iter().map(|(i, j)| [a[rows[i]], b[j]]).collect()
        }
        _ => Vec::new(),
    };
    if pairs.len() < FEWEST {
        let n = rows.iter().filter(|row| nearest_to(a[**row], &knn) <= near).count();
        let message = format!(
            "second map: near {n} of {} points of the first one: in another frame?",
            rows.len()
        );
        return Ok((3 * n < rows.len()).then_some(message));
    }
    let fits =
        |map: &Similar| pairs.iter().filter(|[p, q]| distance(&map.of(p), q) <= near).count();
    let (same, mut draws) = (fits(&Similar::SAME), Draws::new(0, Stage::Subset, 0));
    let mut best = (same, Similar::SAME);
    for _ in 0..TRIES {
        let three = [(); 3].map(|()| pairs[draws.below(pairs.len() as u64) as usize]);
        let Some(map) = Similar::through(&three) else { continue };
        let n = fits(&map);
        if n > best.0 {
            best = (n, map);
        }
    }
    let (n, map) = best;
    let of = pairs.len();
    Ok(if n >= FEWEST && n > 2 * same {
        Some(format!(
            "second map: {same} of {of} points with similar descriptors are at one place, {n} after a turn of the first map by \
             {:.1} degrees, a scale of {} and a shift of {}: both must be in one frame and scale",
            map.angle(),
            short(map.scale),
            short(dot(&map.shift, &map.shift).sqrt()),
        ))
    } else if 10 * same < of {
        Some(format!(
            "second map: {same} of {of} points with similar descriptors are at one place: is it of the same place?"
        ))
    } else {
        None
    })
}

struct Similar {
    scale: f64,
    rotation: [[f64; 3]; 3],
    shift: [f64; 3],
}

impl Similar {
    const SAME: Self = Self {
        scale: 1.0,
        rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        shift: [0.0; 3],
    };

    /// Returns the transform that maps a triangle to another one, up to its shape; `None` if one is flat.
    fn through(pairs: &[[[f64; 3]; 2]; 3]) -> Option<Self> {
        let [(length_a, a), (length_b, b)] = [0, 1].map(|side| {
            let [p, q, r] = [0, 1, 2].map(|at| pairs[at][side]);
            let (u, v) = (sub(&q, &p), sub(&r, &p));
            let n = cross(&u, &v);
            let unit = |x: [f64; 3]| x.map(|value| value / dot(&x, &x).sqrt());
            (dot(&u, &u).sqrt() + dot(&v, &v).sqrt(), [unit(u), unit(n), cross(&unit(n), &unit(u))])
        });
        let rotation =
            [0, 1, 2].map(|r| [0, 1, 2].map(|c| (0..3).map(|k| b[k][r] * a[k][c]).sum()));
        let turned = Self { scale: length_b / length_a, rotation, shift: [0.0; 3] };
        let shift = sub(&pairs[0][1], &turned.of(&pairs[0][0]));
        let is_finite =
            turned.scale.is_finite() && rotation.as_flattened().iter().all(|x: &f64| x.is_finite());
        is_finite.then_some(Self { shift, ..turned })
    }

    fn of(&self, p: &[f64; 3]) -> [f64; 3] {
        along(&self.shift, self.scale, &self.rotation.map(|row| dot(&row, p)))
    }

    fn angle(&self) -> f64 {
        let trace: f64 = (0..3).map(|at| self.rotation[at][at]).sum();
        libm::acos((0.5 * (trace - 1.0)).clamp(-1.0, 1.0)).to_degrees()
    }
}
