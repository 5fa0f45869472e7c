//! Released maps: records by family, and descriptors.

use super::column::{Batch, Type, coordinate_names};
use super::header::{Kind, insert_fingerprint, new_meta};
use super::table::Table;
use super::write::{Written, write_table};
use crate::Error;
use crate::atomic::Access;
use arrow_array::types::{Float32Type, UInt8Type};
use serde_json::{Value, json};
use std::ops::Range;
use std::path::Path;
use unlift::Descriptors;
use unlift::descriptors::Values;
use unlift::geometry::frame::Bounds;
use unlift::released::{AxisCandidates, AxisPlanes, Lines, Obfuscation, Rays, Released};

/// Known descriptors have up to 4,096 values.
const MOST_VALUES: u64 = 1 << 16;

/// Writes a released map, one row per record.
///
/// It contains nothing of the ground truth: no ids, names or times.
///
/// # Errors
/// When the file cannot be written, or the map has protected descriptors, for which there is no format.
pub fn write_released<const D: usize>(path: &Path, released: &Released<D>) -> Result<(), Error> {
    write_table((path, Access::Usual), &written(path, released)?)
}

pub(super) fn written<'a, const D: usize>(
    path: &Path,
    released: &'a Released<D>,
) -> Result<Written<'a>, Error> {
    if released.protected().is_some() {
        return Err(Error::new(path, "", "a map with plain descriptors", "protected descriptors"));
    }
    let obfuscation = released.obfuscation();
    let per_record = released.slots_per_record();
    let mut meta = new_meta(Kind::Released);
    meta.insert("family".into(), json!(obfuscation.family()));
    meta.insert("dimension".into(), json!(D));
    meta.insert("slots_per_record".into(), json!(per_record));
    meta.insert("origin".into(), json!(released.origin().to_vec()));
    meta.insert("unit".into(), json!(released.unit().name()));
    insert_fingerprint(&mut meta, Some(released.fingerprint()));
    if let Some(bounds) = released.bounds() {
        meta.insert("bounds".into(), corners(&bounds));
    }
    if let Obfuscation::Rays(rays) = obfuscation {
        let centers = rays.centers().iter();
        let centers: Vec<Vec<f64>> = centers.map(|c| c.map(f64::from).to_vec()).collect();
        meta.insert("centers".into(), json!(centers));
        if let Some(regions) = rays.regions() {
            let regions: Vec<Value> = regions.iter().map(corners).collect();
            meta.insert("regions".into(), json!(regions));
        }
    }
    let mut written = Written::new(meta, released.n_records());
    match obfuscation {
        Obfuscation::Lines(lines) => {
            vectors(&mut written, "foot_", lines.foot());
            vectors(&mut written, "direction_", lines.direction());
        }
        Obfuscation::Rays(rays) => {
            written.numbers::<UInt8Type>("center", |row| rays.center()[row]);
            vectors(&mut written, "direction_", rays.direction());
        }
        Obfuscation::AxisPlanes(planes) => {
            written.numbers::<UInt8Type>("axis", |row| planes.axis()[row]);
            written.numbers::<Float32Type>("offset", |row| planes.offset()[row]);
        }
        Obfuscation::AxisCandidates(candidates) => {
            vectors(&mut written, "", candidates.position());
        }
    }
    if let Some(descriptors) = released.descriptors() {
        let dim = descriptors.dim();
        for (k, name) in descriptor_names(per_record).enumerate() {
            let slots = move |rows: Range<usize>| rows.map(move |row| row * per_record + k);
            match descriptors.values() {
                Values::U8(values) => {
                    written.lists::<UInt8Type>(name, move |rows| cut(values, dim, slots(rows)));
                }
                Values::F32(values) => {
                    written.lists::<Float32Type>(name, move |rows| cut(values, dim, slots(rows)));
                }
            }
        }
    }
    Ok(written)
}

fn vectors<'a, const D: usize>(written: &mut Written<'a>, prefix: &str, rows: &'a [[f32; D]]) {
    for (axis, name) in coordinate_names::<D>(prefix).into_iter().enumerate() {
        written.numbers::<Float32Type>(name, move |row| rows[row][axis]);
    }
}

/// Returns the rows `slots` of a matrix of `dim` columns, concatenated, and their lengths.
fn cut<T: Copy>(
    values: &[T],
    dim: usize,
    slots: impl ExactSizeIterator<Item = usize>,
) -> (Vec<T>, Vec<usize>) {
    let lengths = vec![dim; slots.len()];
    (slots.flat_map(|slot| values[slot * dim..(slot + 1) * dim].iter().copied()).collect(), lengths)
}

/// Reads a released map of dimension `D` (see [`peek`](super::peek)).
///
/// Directions need not have unit length, and feet need not be nearest to the origin: records are
/// normalized. Missing metadata is inferred from the columns where possible.
///
/// # Errors
/// When the file differs from `docs/formats.md`, or has another dimension.
pub fn read_released<const D: usize>(path: &Path) -> Result<Released<D>, Error> {
    released_of(&Table::open_kind(path, Kind::Released)?)
}

/// Returns the name of the scheme that the released map at `path` states, if any. unlift writes
/// none.
///
/// # Errors
/// When it is not a Parquet file, or the name is not text.
pub fn scheme_name(path: &Path) -> Result<Option<String>, Error> {
    let table = Table::open(path)?;
    table.meta().optional_text("scheme")
}

pub(super) fn released_of<const D: usize>(table: &Table<'_>) -> Result<Released<D>, Error> {
    let core = |source| table.refused(source);
    let meta = table.meta();
    let family = family(table)?;
    table.expect_dimension::<D>()?;
    let (origin, unit) = (meta.origin::<D>()?, table.unit::<D>(None)?);
    let per_record = meta.count("slots_per_record")?.unwrap_or(1);
    if per_record > 2 {
        return Err(meta.wrong("slots_per_record", "1 or 2"));
    }
    let obfuscation = match family {
        Family::Lines => read_lines(table)?,
        Family::Rays => read_rays(table)?,
        Family::AxisPlanes => read_axis_planes(table)?,
        Family::AxisCandidates => {
            let [position] = read_vectors(table, [""])?;
            Obfuscation::AxisCandidates(AxisCandidates::try_new(&position).map_err(core)?)
        }
    };
    let descriptors = read_descriptors(table, per_record)?;
    let bounds = meta.bounds::<D>()?;
    let released = Released::try_new(obfuscation, per_record, origin, unit, descriptors);
    let released = released.map_err(core)?.with_bounds(bounds);
    let found = released.fingerprint();
    match meta.fingerprint()? {
        Some(said) if said != found => {
            let expected =
                format!("the fingerprint of the content, {found}, or none (the file was changed)");
            Err(meta.wrong("fingerprint", expected))
        }
        _ => Ok(released),
    }
}

enum Family {
    Lines,
    Rays,
    AxisPlanes,
    AxisCandidates,
}

fn family(table: &Table<'_>) -> Result<Family, Error> {
    let names = "lines, rays, axis_planes or axis_candidates";
    match table.meta().text("family") {
        Some("lines") => Ok(Family::Lines),
        Some("rays") => Ok(Family::Rays),
        Some("axis_planes") => Ok(Family::AxisPlanes),
        Some("axis_candidates") => Ok(Family::AxisCandidates),
        Some(_) => Err(table.meta().wrong("family", names)),
        None if table.has("foot_x") => Ok(Family::Lines),
        None if table.has("center") => Ok(Family::Rays),
        None if table.has("offset") => Ok(Family::AxisPlanes),
        None if table.has("x") => Ok(Family::AxisCandidates),
        None => Err(table.meta().wrong("family", format!("{names}, or the columns of one"))),
    }
}

fn corners<const D: usize>(bounds: &Bounds<D>) -> Value {
    json!([bounds.low.to_vec(), bounds.high.to_vec()])
}

fn descriptor_names(per_record: usize) -> impl Iterator<Item = String> {
    (0..per_record).map(move |slot| match per_record {
        1 => "descriptor".into(),
        _ => format!("descriptor_{slot}"),
    })
}

fn read_lines<const D: usize>(table: &Table<'_>) -> Result<Obfuscation<D>, Error> {
    let [foot, direction] = read_vectors(table, ["foot_", "direction_"])?;
    let lines = Lines::through(&foot, &direction);
    lines.map(Obfuscation::Lines).map_err(|source| table.refused(source))
}

fn read_rays<const D: usize>(table: &Table<'_>) -> Result<Obfuscation<D>, Error> {
    let centers = table.meta().centers::<D>()?;
    if centers.is_empty() || centers.len() > 255 {
        return Err(table.meta().wrong("centers", "1 to 255 centers"));
    }
    let mut center: Vec<u8> = Vec::new();
    table.read(&[("center", Type::Integer)], |batch| {
        let rows = batch.integers("center", centers.len() as u64)?;
        center.extend(rows.into_iter().map(|c| c as u8));
        Ok(())
    })?;
    let [direction] = read_vectors(table, ["direction_"])?;
    let rays = Rays::try_new(&centers, center, &direction);
    let rays = match table.meta().regions::<D>()? {
        Some(regions) => rays.and_then(|rays| rays.with_regions(regions)),
        None => rays,
    };
    rays.map(Obfuscation::Rays).map_err(|source| table.refused(source))
}

fn read_axis_planes<const D: usize>(table: &Table<'_>) -> Result<Obfuscation<D>, Error> {
    let (mut axis, mut offset): (Vec<u8>, Vec<f64>) = (Vec::new(), Vec::new());
    let columns = [("axis", Type::Integer), ("offset", Type::Float)];
    table.read(&columns, |batch| {
        let rows = batch.integers("axis", D as u64)?;
        axis.extend(rows.into_iter().map(|a| a as u8));
        offset.extend(batch.floats("offset")?);
        Ok(())
    })?;
    let planes = AxisPlanes::try_new(axis, &offset);
    planes.map(Obfuscation::AxisPlanes).map_err(|source| table.refused(source))
}

fn read_vectors<const D: usize, const N: usize>(
    table: &Table<'_>,
    prefixes: [&str; N],
) -> Result<[Vec<[f64; D]>; N], Error> {
    let names = prefixes.map(coordinate_names::<D>);
    let columns: Vec<(&str, Type)> =
        names.iter().flatten().map(|name| (name.as_str(), Type::Float)).collect();
    let mut vectors: [Vec<[f64; D]>; N] = std::array::from_fn(|_| Vec::new());
    table.read(&columns, |batch| {
        for (names, to) in names.iter().zip(&mut vectors) {
            batch.vectors(names, to)?;
        }
        Ok(())
    })?;
    Ok(vectors)
}

/// Reads the descriptor columns: integers as bytes, floats as `f32`.
fn read_descriptors(table: &Table<'_>, per_record: usize) -> Result<Option<Descriptors>, Error> {
    let names: Vec<String> = descriptor_names(per_record).collect();
    if !names.iter().any(|name| table.has(name)) || table.n_rows() == 0 {
        return Ok(None);
    }
    let bytes = table.is(&names[0], Type::Integers);
    // Either type is accepted; the second column must have the type of the first.
    let class = match bytes {
        true => Type::Integers,
        false if table.is(&names[0], Type::Floats) => Type::Floats,
        false => Type::Numbers,
    };
    let columns: Vec<(&str, Type)> = names.iter().map(|name| (name.as_str(), class)).collect();
    let found = if bytes {
        let rows = descriptor_rows(table, &columns, |batch, name| {
            let (mut offsets, mut values) = (vec![0], Vec::new());
            batch.integer_lists(name, 256, MOST_VALUES, &mut offsets, &mut values)?;
            let lengths = offsets.windows(2).map(|w| (w[1] - w[0]) as usize).collect();
            Ok((values.into_iter().map(|x| x as u8).collect(), lengths))
        })?;
        rows.map(|(values, dim)| (Values::U8(values), dim))
    } else {
        let rows = descriptor_rows(table, &columns, |batch, name| {
            let mut values = Vec::new();
            let lengths = batch.float_lists(name, MOST_VALUES, &mut values)?;
            Ok((values, lengths))
        })?;
        rows.map(|(values, dim)| (Values::F32(values), dim))
    };
    let descriptors = found.map(|(values, dim)| Descriptors::try_new(values, dim));
    descriptors.transpose().map_err(|source| table.refused(source))
}

/// Reads the values of all lists in `columns`, row by row, and the common length of the lists.
/// Returns `None` if there are no lists.
///
/// `read` returns the values of a column, concatenated, and the length of each list.
fn descriptor_rows<T: Copy>(
    table: &Table<'_>,
    columns: &[(&str, Type)],
    read: impl Fn(&Batch<'_>, &str) -> Result<(Vec<T>, Vec<usize>), Error>,
) -> Result<Option<(Vec<T>, usize)>, Error> {
    let (mut all, mut dim, mut n_without) = (Vec::new(), None, 0);
    table.read(columns, |batch| {
        if columns.iter().all(|(name, _)| batch.is_null(name)) {
            n_without += batch.len();
            return Ok(());
        }
        let mut slots = Vec::with_capacity(columns.len());
        for (name, _) in columns {
            let (values, lengths) = read(batch, name)?;
            for (row, &length) in lengths.iter().enumerate() {
                let dim = *dim.get_or_insert(length);
                if length == 0 || length != dim {
                    let expected = format!("{} values as in every row", dim.max(1));
                    return Err(batch.wrong(name, row, expected, length.to_string()));
                }
            }
            slots.push(values);
        }
        let dim = dim.unwrap_or(0);
        for row in 0..batch.len() {
            for values in &slots {
                all.extend_from_slice(&values[row * dim..(row + 1) * dim]);
            }
        }
        Ok(())
    })?;
    let is_without = table.is_without(columns[0].0, n_without)?;
    Ok((!is_without).then_some((all, dim.unwrap_or(0))))
}
