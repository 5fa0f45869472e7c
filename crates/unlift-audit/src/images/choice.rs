//! The choice of images to use and to draw.

use unlift::audit::Threshold;
use unlift_report::pictures::MOST_PICTURES;

use crate::Error;

/// The headline threshold in pixels; the nearest given threshold is used.
const HEADLINE_PX: f64 = 10.0;

/// Returns the index of the headline threshold in `thresholds`.
pub fn headline(thresholds: &[Threshold]) -> usize {
    let away = |at: &usize| (thresholds[*at].value / HEADLINE_PX).ln().abs();
    (0..thresholds.len()).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(0)
}

/// Returns the numbers of at most `most` of `n` images, evenly spaced: the middles of equal parts.
pub fn evenly(n: usize, most: Option<usize>) -> Vec<usize> {
    let most = most.unwrap_or(n).min(n);
    (0..most).map(|at| ((2 * at + 1) * n) / (2 * most)).collect()
}

/// Returns the numbers of the images `wanted`, without repetition. `names` are all images, `chosen`
/// those in use, and `place` their source.
///
/// # Errors
/// If one of them is not in use, or there are more than a page shows.
pub fn shown(
    wanted: &[String],
    names: &[String],
    chosen: &[usize],
    place: &str,
) -> Result<Vec<usize>, Error> {
    let mut numbers = Vec::with_capacity(wanted.len());
    for name in wanted {
        let at = names.binary_search_by(|other| other.as_bytes().cmp(name.as_bytes()));
        let found =
            |expected: &str| Error::request(format!("--show: expected {expected}, found {name}"));
        let at = at.map_err(|_| found(&format!("an image of {place}")))?;
        if !chosen.contains(&at) {
            return Err(found("an image that --max-images keeps"));
        }
        if !numbers.contains(&at) {
            numbers.push(at);
        }
    }
    if numbers.len() > MOST_PICTURES {
        let n = numbers.len();
        let expected = format!("--show: expected at most {MOST_PICTURES} images, found {n}");
        return Err(Error::request(expected));
    }
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_evenly_spaced_and_all_without_a_limit() {
        assert_eq!(evenly(4, None), [0, 1, 2, 3]);
        assert_eq!(evenly(10, Some(3)), [1, 5, 8]);
        assert_eq!(evenly(3, Some(9)), [0, 1, 2]);
        assert_eq!(evenly(0, Some(2)), [0; 0]);
    }

    #[test]
    fn what_is_drawn_is_named_once_and_in_use() {
        let names: Vec<String> = (0..20).map(|at| format!("{at:02}.jpg")).collect();
        let of = |wanted: &[&str]| {
            let wanted: Vec<String> = wanted.iter().map(|name| (*name).to_owned()).collect();
            shown(&wanted, &names, &(0..19).collect::<Vec<_>>(), "photos")
                .map_err(|error| error.to_string())
        };
        assert_eq!(of(&["07.jpg", "03.jpg", "07.jpg"]), Ok(vec![7, 3]));
        let line = "--show: expected an image of photos, found x";
        assert_eq!(of(&["x"]), Err(line.to_owned()));
        assert!(of(&["19.jpg"]).is_err_and(|line| line.contains("--max-images")));
        let many: Vec<&str> = names.iter().take(MOST_PICTURES + 1).map(String::as_str).collect();
        assert!(of(&many).is_err_and(|line| line.contains("at most")));
    }
}
