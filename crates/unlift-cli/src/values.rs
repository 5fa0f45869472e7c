//! Parses option values; gates are parsed by `unlift_audit::Gate`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use crate::output::tell;
use unlift::audit::Threshold;
use unlift::neighbors::sources::Named;
use unlift::obfuscate::{Entry, Mitigation};
use unlift::recover::Builtin;
use unlift_audit::number;
use unlift_audit::sources;
pub use unlift_audit::{positive, ratio};
use unlift_report::compare::Accepted;

#[derive(Clone, Debug, PartialEq)]
pub enum NeighborSource {
    /// Lists from ground truth, at chosen inlier ratios.
    Oracle,
    /// Lists from the released map alone.
    Own(Named),
    /// A file with lists by point.
    File(PathBuf),
}

impl NeighborSource {
    pub fn files(sources: &[Self]) -> impl Iterator<Item = &PathBuf> {
        sources.iter().filter_map(|source| match source {
            Self::File(path) => Some(path),
            Self::Oracle | Self::Own(_) => None,
        })
    }
}

/// Converts the error of `parse` to what was expected and found.
pub fn by<T>(
    parse: fn(&str) -> Result<T, unlift::Error>,
) -> impl Fn(&str) -> Result<T, String> + Clone {
    move |text| {
        parse(text)
            .map_err(|error| format!("expected {}, found {}", error.expected(), error.found()))
    }
}

/// Parses a number of points, images or features. Stage files number rows with 32 bits.
pub fn count(text: &str) -> Result<NonZeroUsize, String> {
    const MAX: usize = u32::MAX as usize;
    let expected = format!("a whole number from 1 to {MAX}");
    number(text, &expected, |number: &NonZeroUsize| number.get() <= MAX)
}

/// Parses the reason why inputs of a comparison may differ.
pub fn accepted(text: &str) -> Result<Accepted, String> {
    Accepted::parse(text).map_err(|expected| format!("expected {expected}, found {text}"))
}

/// Parses a score in `0..1`.
pub fn score(text: &str) -> Result<f32, String> {
    number(text, "a number from 0 to below 1", |score| (0.0..1.0).contains(score))
}

/// Parses a scheme in `D` dimensions, also one that is audited only on request.
pub fn scheme<const D: usize>(text: &str) -> Result<&'static Entry, String> {
    let fitting: Vec<_> = unlift::obfuscate::all().filter(|of| of.dimensions() == D).collect();
    fitting.iter().find(|entry| entry.name == text).copied().ok_or_else(|| {
        let unfit = if D == 3 { " (for images only)" } else { " (for maps only)" };
        let note = if unlift::obfuscate::scheme(text).is_ok() { unfit } else { "" };
        none_of(fitting.iter().map(|entry| entry.name), text) + note
    })
}

/// Parses `olc`, the same scheme twice, or `olc/cp`, two different ones.
pub fn scheme_pair(text: &str) -> Result<[&'static Entry; 2], String> {
    let (a, b) = text.split_once('/').unwrap_or((text, text));
    Ok([scheme::<3>(a)?, scheme::<3>(b)?])
}

/// Returns the error for `text`, which is none of `names`.
fn none_of<'a>(names: impl IntoIterator<Item = &'a str>, text: &str) -> String {
    let names: Vec<&str> = names.into_iter().collect();
    format!("expected one of {}, found {text}", names.join(", "))
}

/// Parses a solver for images, which must use lists: in the plane all lines intersect, so records alone reveal nothing.
pub fn image_solver(text: &str) -> Result<Builtin, String> {
    let of_lists = solver(text).ok().filter(|solver| Builtin::FROM_LISTS.contains(solver));
    of_lists.ok_or_else(|| none_of(Builtin::FROM_LISTS.map(|solver| solver.name()), text))
}

pub fn image_source(text: &str) -> Result<NeighborSource, String> {
    let is_of_maps = |source: &NeighborSource| matches!(source, NeighborSource::Own(named) if named.of_dimension::<2>().is_err());
    any_source(text).ok().filter(|source| !is_of_maps(source)).ok_or_else(|| {
        let all = sources::all();
        let of_images = all.iter().filter(|entry| entry.in_2d.is_some()).map(|entry| entry.name);
        none_of(["oracle"].into_iter().chain(of_images), text)
    })
}

/// Parses a source of lists that needs no ground truth.
pub fn own_image_source(text: &str) -> Result<Named, String> {
    match image_source(text)? {
        NeighborSource::Own(named) => Ok(named),
        _ => Err(format!("expected a source that reads released data, found {text}")),
    }
}

/// Parses a change to the descriptors of single images.
pub fn image_mitigation(text: &str) -> Result<Mitigation, String> {
    match by(Mitigation::parse)(text)? {
        mitigation if mitigation.fits_images() => Ok(mitigation),
        _ => Err(format!("expected noise:DEVIATION or drop:SHARE, found {text}")),
    }
}

/// Parses the name of a solver. Former names are read with a note.
pub fn solver(text: &str) -> Result<Builtin, String> {
    let solver = by(Builtin::from_name)(text)?;
    if solver.name() != text {
        tell(format_args!("unlift: note: the solver {text} is called {} now", solver.name()));
    }
    Ok(solver)
}

pub fn scale(text: &str) -> Result<f64, String> {
    positive(text)
        .map_err(|_| format!("expected meters per unit of the map, a number above 0, found {text}"))
}

/// Parses a threshold; reports use the typed text as key.
pub fn threshold(text: &str) -> Result<Threshold, String> {
    Threshold::parse(text).map_err(|_| format!("expected a number above 0, found {text}"))
}

/// Parses the name of a source, or a path.
pub fn neighbor_source(text: &str) -> Result<NeighborSource, String> {
    if text.is_empty() {
        return Err("expected oracle, a source or a file".to_owned());
    }
    // If one name of a list is known, an unknown one is a typo, not a missing file.
    let is_path = text.contains(std::path::is_separator);
    match any_source(text) {
        Ok(source) => Ok(source),
        Err(_) if !is_path && text.split([',', '+']).any(|name| any_source(name).is_ok()) => {
            Err(format!("expected one source (repeat the option for rows of each), found {text}"))
        }
        Err(_) => Ok(NeighborSource::File(text.into())),
    }
}

pub fn any_source(text: &str) -> Result<NeighborSource, String> {
    match text {
        "oracle" => Ok(NeighborSource::Oracle),
        name => by(sources::named)(name).map(NeighborSource::Own),
    }
}

/// Parses a number of queries: two or more.
pub fn queries(text: &str) -> Result<usize, String> {
    number(text, "a whole number from 2", |n| *n >= 2)
}

/// Parses `perturbed:CM,DEG`.
pub fn poses(text: &str) -> Result<(f64, f64), String> {
    let wrong = || format!("expected perturbed:CM,DEG (for example perturbed:5,0.5), found {text}");
    let (cm, angle) =
        text.strip_prefix("perturbed:").and_then(|of| of.split_once(',')).ok_or_else(wrong)?;
    let size =
        |text: &str| number(text, "", |x: &f64| x.is_finite() && *x >= 0.0).map_err(|_| wrong());
    Ok((size(cm)?, size(angle)?))
}

/// Parses the longest side of a map in meters: `5..50`.
pub fn extent(text: &str) -> Result<(f64, f64), String> {
    let sides = text.split_once("..");
    let range = sides.and_then(|(low, high)| Some((positive(low).ok()?, positive(high).ok()?)));
    let range = range.filter(|(low, high)| low <= high);
    range.ok_or_else(|| format!("expected LOW..HIGH in meters (for example 5..50), found {text}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_sources_are_names_and_the_rest_are_files() {
        let file = |path: &str| NeighborSource::File(path.into());
        for (text, expected) in [
            ("oracle", NeighborSource::Oracle),
            ("overlap", NeighborSource::Own(Named::parse("overlap").unwrap())),
            ("./overlap", file("./overlap")),
            ("./lists,overlap", file("./lists,overlap")),
            ("lists,overlapping.npz", file("lists,overlapping.npz")),
        ] {
            assert_eq!(neighbor_source(text), Ok(expected));
        }
        for names in ["overlap,similarity", "overlap+similarity", "oracle,overlop"] {
            let several = neighbor_source(names).unwrap_err();
            assert!(several.starts_with("expected one source (repeat the option"), "{several}");
        }
    }
}
