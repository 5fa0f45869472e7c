//! Released maps: records by family, and descriptors.

use std::path::Path;
use std::sync::Arc;

use unlift::descriptors::Values;
use unlift::geometry::frame::Bounds;
use unlift::protected::Rule;
use unlift::released::{AxisCandidates, AxisPlanes, Lines, Obfuscation, Rays, Released};
use unlift::{Descriptors, ProtectedDescriptors};

use super::arrays::Arrays;
use super::kind::{Kind, PUBLIC, SUBSPACE, WORDS};
use super::meta::{EPSILON, OF_BYTES};
use super::write::{Written, write_file};
use crate::Error;
use crate::atomic::Access;

/// The names of the families, and the array that only one of them has.
const FAMILIES: [(&str, &str); 4] = [
    ("lines", "foot"),
    ("rays", "center"),
    ("axis_planes", "offset"),
    ("axis_candidates", "position"),
];

/// Writes a released map, one row per record.
///
/// It contains nothing of the ground truth: no ids, names or times. Its metadata state the name of the `scheme`, if it is known.
pub fn write_released<const D: usize>(
    path: &Path,
    released: &Released<D>,
    scheme: Option<&str>,
) -> Result<(), Error> {
    let mut written = written(released);
    written.state("scheme", scheme);
    write_file(path, Access::Usual, written)
}

pub(super) fn written<const D: usize>(released: &Released<D>) -> Written<'_> {
    let obfuscation = released.obfuscation();
    let (n, slots) = (released.n_records(), released.slots_per_record());
    let mut written = Written::new(Kind::Released, n);
    written.state("family", obfuscation.family());
    written.state("slots_per_record", slots);
    written.state("unit", released.unit().name());
    written.state("fingerprint", released.fingerprint().to_string());
    match obfuscation {
        Obfuscation::Lines(lines) => {
            written.vectors("foot", lines.foot());
            written.vectors("direction", lines.direction());
        }
        Obfuscation::Rays(rays) => {
            written.vectors("centers", rays.centers());
            written.array("center", &[n], rays.center().iter().copied());
            written.vectors("direction", rays.direction());
            if let Some(regions) = rays.regions() {
                written.array("regions", &[regions.len(), 2, D], regions.iter().flat_map(corners));
            }
        }
        Obfuscation::AxisPlanes(planes) => {
            written.array("axis", &[n], planes.axis().iter().copied());
            written.array("offset", &[n], planes.offset().iter().copied());
        }
        Obfuscation::AxisCandidates(candidates) => {
            written.vectors("position", candidates.position());
        }
    }
    match (released.protected(), released.descriptors()) {
        (Some(protected), _) => write_protected(&mut written, protected, [n, slots]),
        (None, Some(plain)) => {
            let (one, several) = ([n, plain.dim()], [n, slots, plain.dim()]);
            let shape = if slots == 1 { &one[..] } else { &several };
            write_rows(&mut written, "descriptor", plain, shape);
        }
        (None, None) => {}
    }
    written.array("origin", &[D], released.origin().into_iter());
    if let Some(bounds) = released.bounds() {
        written.array("bounds", &[2, D], corners(&bounds));
    }
    written
}

fn write_rows<'a>(
    written: &mut Written<'a>,
    name: &'static str,
    rows: &'a Descriptors,
    shape: &[usize],
) {
    match rows.values() {
        Values::U8(values) => written.array(name, shape, values.iter().copied()),
        Values::F32(values) => written.array(name, shape, values.iter().copied()),
    }
}

/// Writes protected descriptors, and the public ones that they are made with.
fn write_protected<'a>(
    written: &mut Written<'a>,
    protected: &'a ProtectedDescriptors,
    [n, slots]: [usize; 2],
) {
    let rows = protected.rows();
    match protected.rule() {
        Rule::Subspace { m } => {
            write_rows(written, SUBSPACE, rows, &[n, slots, m + 1, protected.dim()]);
        }
        Rule::Words { m, epsilon } => {
            let Values::F32(words) = rows.values() else { return };
            written.array(WORDS, &[n, slots, m], words.iter().map(|&word| word as i32));
            written.state(EPSILON, epsilon);
        }
    }
    written.state(OF_BYTES, protected.of_bytes());
    if let Some(public) = protected.public() {
        write_rows(written, PUBLIC, public, &[public.len(), public.dim()]);
    }
}

fn corners<const D: usize>(bounds: &Bounds<D>) -> impl Iterator<Item = f64> + use<D> {
    bounds.low.into_iter().chain(bounds.high)
}

/// Reads a released map of dimension `D`.
///
/// Directions need not have unit length, and feet need not be nearest to the origin: records are normalized.
///
/// # Errors
/// When the file differs from `docs/formats.md`, or has another dimension.
pub fn read_released<const D: usize>(path: &Path) -> Result<Released<D>, Error> {
    released_of(&Arrays::open(path)?)
}

/// Returns the name of the scheme that the released map at `path` states, if any. unlift writes none.
///
/// # Errors
/// When it is not a stage file, or the name is not text.
pub fn scheme_name(path: &Path) -> Result<Option<String>, Error> {
    Ok(Arrays::open(path)?.meta.text("scheme")?.map(str::to_owned))
}

/// Returns positions that the file at `path` publishes, one per record: those of its arrays as they
/// are written, feet and centers, and these plus directions. Nothing of them is left in the normal form of [`read_released`].
///
/// # Errors
/// When it is no released map of dimension `D`.
pub fn published_positions<const D: usize>(path: &Path) -> Result<Vec<Vec<[f64; D]>>, Error> {
    let arrays = Arrays::open(path)?;
    let from: Vec<[f64; D]> = match family(&arrays)? {
        "lines" => arrays.vectors("foot", None)?,
        "rays" => {
            let centers = arrays.vectors("centers", None)?;
            let (center, _) = arrays.integers("center", [None], centers.len(), false)?;
            center.into_iter().map(|center| centers[center as usize]).collect()
        }
        // The normal form keeps all values of these.
        _ => return Ok(Vec::new()),
    };
    let direction = arrays.vectors("direction", Some(from.len()))?;
    let origin = arrays.origin()?;
    let plus = |a: &[f64; D], b: &[f64; D]| std::array::from_fn(|c| a[c] + b[c]);
    let from: Vec<[f64; D]> = from.iter().map(|x| plus(x, &origin)).collect();
    let to = from.iter().zip(&direction).map(|(x, along)| plus(x, along)).collect();
    Ok(vec![from, to])
}

pub(super) fn released_of<const D: usize>(arrays: &Arrays<'_>) -> Result<Released<D>, Error> {
    let core = |source| arrays.refused(source);
    let meta = &arrays.meta;
    let family = family(arrays)?;
    arrays.expect(Kind::Released)?;
    let unit = arrays.meta.unit::<D>(None)?;
    let slots = meta.slots_per_record()?.unwrap_or(1);
    let obfuscation = match family {
        "lines" => {
            let foot = arrays.vectors("foot", None)?;
            let direction = arrays.vectors("direction", Some(foot.len()))?;
            Lines::through(&foot, &direction).map(Obfuscation::Lines)
        }
        "rays" => rays(arrays)?.map(Obfuscation::Rays),
        "axis_planes" => {
            let (axis, [n]) = arrays.integers("axis", [None], D, false)?;
            let (offset, _) = arrays.floats("offset", [Some(n)])?;
            let axis = axis.into_iter().map(|axis| axis as u8).collect();
            AxisPlanes::try_new(axis, &offset).map(Obfuscation::AxisPlanes)
        }
        _ => {
            let position = arrays.vectors("position", None)?;
            AxisCandidates::try_new(&position).map(Obfuscation::AxisCandidates)
        }
    };
    let obfuscation = obfuscation.map_err(core)?;
    let descriptors = descriptors(arrays, obfuscation.len(), slots)?;
    let corners = |name| boxes(arrays, name, &arrays.floats(name, [Some(2), Some(D)])?.0);
    let bounds = arrays.optional("bounds", corners)?.and_then(|mut boxes| boxes.pop());
    let released = Released::try_new(obfuscation, slots, arrays.origin()?, unit, descriptors);
    let released = released.map_err(core)?.with_bounds(bounds);
    let released = match protected(arrays, released.n_records(), slots)? {
        Some(protected) => released.with_protected(protected).map_err(core)?,
        None => released,
    };
    let found = released.fingerprint();
    match meta.fingerprint()? {
        Some(stated) if stated != found => {
            let expected =
                format!("the fingerprint of the content, {found}, or none (the file was changed)");
            Err(meta.wrong("fingerprint", expected))
        }
        _ => Ok(released),
    }
}

/// The family by the metadata, else by the arrays.
fn family(arrays: &Arrays<'_>) -> Result<&'static str, Error> {
    let stated = arrays.meta.text("family")?;
    let is_it = |(name, array): &(&str, &str)| {
        stated.map_or_else(|| arrays.has(array), |stated| stated == *name)
    };
    if let Some((name, _)) = FAMILIES.into_iter().find(is_it) {
        return Ok(name);
    }
    if stated.is_some() {
        let names = FAMILIES.map(|(name, _)| name).join(", ");
        return Err(arrays.meta.wrong("family", format!("one of {names}")));
    }
    let arrays_of = FAMILIES.map(|(_, array)| array).join(", ");
    let expected = format!("a released map, with one of the arrays {arrays_of}");
    let found = match arrays.kind() {
        Ok(Some(kind)) if kind != Kind::Released => kind.to_string(),
        _ => arrays.list(),
    };
    Err(Error::new(arrays.path, "", expected, found))
}

fn rays<const D: usize>(arrays: &Arrays<'_>) -> Result<Result<Rays<D>, unlift::Error>, Error> {
    let centers = arrays.vectors("centers", None)?;
    if centers.is_empty() || centers.len() > 255 {
        let found = format!("{} rows", centers.len());
        return Err(Error::new(arrays.path, "array centers", "1 to 255 rows", found));
    }
    let (center, [n]) = arrays.integers("center", [None], centers.len(), false)?;
    let center = center.into_iter().map(|center| center as u8).collect();
    let direction = arrays.vectors("direction", Some(n))?;
    let mut rays = Rays::try_new(&centers, center, &direction);
    if arrays.has("regions") {
        let (corners, _) = arrays.floats("regions", [Some(centers.len()), Some(2), Some(D)])?;
        let regions = boxes(arrays, "regions", &corners)?;
        rays = rays.and_then(|rays| rays.with_regions(regions));
    }
    Ok(rays)
}

fn boxes<const D: usize>(
    arrays: &Arrays<'_>,
    name: &str,
    corners: &[f64],
) -> Result<Vec<Bounds<D>>, Error> {
    let corners: &[[f64; D]] = corners.as_chunks().0;
    let boxes = corners.chunks(2).map(|pair| Bounds::try_new(pair[0], pair[1]));
    boxes.collect::<Result<_, _>>().map_err(|error| arrays.refused(error.within(name)))
}

/// Reads descriptors: integers as bytes, floats as `f32`.
fn descriptors(arrays: &Arrays<'_>, n: usize, slots: usize) -> Result<Option<Descriptors>, Error> {
    if !arrays.has("descriptor") {
        return Ok(None);
    }
    let (values, dim) = match slots {
        1 => arrays.bytes_or_floats("descriptor", [Some(n), None])?,
        _ => arrays.bytes_or_floats("descriptor", [Some(n), Some(slots), None])?,
    };
    if n == 0 {
        return Ok(None);
    }
    Descriptors::try_new(values, dim).map(Some).map_err(|source| arrays.refused(source))
}

fn protected(
    arrays: &Arrays<'_>,
    n: usize,
    slots: usize,
) -> Result<Option<ProtectedDescriptors>, Error> {
    let given = ["descriptor", SUBSPACE, WORDS, PUBLIC].into_iter().filter(|name| arrays.has(name));
    let given: Vec<&str> = given.collect();
    if !matches!(given[..], [] | [_] | [SUBSPACE | WORDS, PUBLIC]) || given == [PUBLIC] {
        let expected =
            format!("one of descriptor, {SUBSPACE} and {WORDS}, and {PUBLIC} beside the last two");
        return Err(Error::new(arrays.path, "arrays", expected, given.join(", ")));
    }
    let public = arrays.optional(PUBLIC, |name| arrays.floats(name, [None, None]))?;
    let n_public = public.as_ref().map_or(0, |(_, [n, _])| *n);
    let (rule, rows, width) = if arrays.has(SUBSPACE) {
        let (rows, [.., points, dim]) =
            arrays.floats(SUBSPACE, [Some(n), Some(slots), None, None])?;
        let rows = rows.into_iter().map(|x| x as f32).collect::<Vec<_>>();
        (Rule::Subspace { m: points.saturating_sub(1) }, rows, points * dim)
    } else if arrays.has(WORDS) {
        let (words, [.., m]) =
            arrays.integers(WORDS, [Some(n), Some(slots), None], n_public, false)?;
        let epsilon = arrays.meta.number(EPSILON)?;
        (Rule::Words { m, epsilon }, words.into_iter().map(|word| word as f32).collect(), m)
    } else {
        return Ok(None);
    };
    let rows = rows.chunks(width.max(1)).map(<[f32]>::to_vec).collect();
    let public = public.map(|(values, [_, dim])| {
        let values = values.into_iter().map(|x| x as f32).collect();
        Descriptors::try_new(Values::F32(values), dim).map(Arc::new)
    });
    let of_bytes = arrays.meta.flag(OF_BYTES)?;
    public
        .transpose()
        .and_then(|public| ProtectedDescriptors::try_new(rule, rows, public, of_bytes))
        .map(Some)
        .map_err(|source| arrays.refused(source))
}
