//! The last step of consensus along a line.

use crate::recover::map::sections::Sections;

/// Least squares over the records within delta of `t` (Eq. (4) with squared distances: on a line a
/// weighted mean of the closest approaches), the support selected anew once. Returns the position
/// and its support.
#[inline(always)]
pub(crate) fn refit(sections: &Sections, t: f32, delta2: f32) -> (f32, u32) {
    // The start of an interval is at delta up to rounding, of delta and of t: it counts as within.
    let reach = delta2.sqrt() * (1.0 + 5e-5) + 4.0 * f32::EPSILON * t.abs();
    let reach2 = reach * reach;
    let (shift, _) = sections.least_squares_step(t, reach2);
    let t = t + shift;
    let (shift, support) = sections.least_squares_step(t, reach2);
    (t + shift, support)
}
