//! A released map and its truth, as another program wrote them.

use std::path::Path;

use unlift::audit::doubts::of_descriptors;
use unlift::released::Released;
use unlift::truth::{Original, Secret};
use unlift::{Fingerprint, PointSet};
use unlift_io::Error as FileError;
use unlift_io::hash::{hash_file, hash_files, hash_positions};
use unlift_io::read::{self, Input as Points};
use unlift_io::stage::{has_images, read_released, read_truth, scheme_name};
use unlift_report::document::Input;

use super::{Prepared, zeros};
use crate::{Error, bail};

/// A released map, its secret, and the original points.
pub struct Release {
    /// The original points.
    pub prepared: Prepared,
    /// The released map and the secret.
    pub hidden: (Released<3>, Secret),
    /// The hash of all points of the truth in any order, which each release changes.
    pub truth_sha256: String,
}

/// The files of a released map.
#[derive(Clone, Copy, Debug)]
pub struct Files<'a> {
    /// The records.
    pub released: &'a Path,
    /// The original points, and the record of each.
    pub truth: &'a Path,
    /// Descriptors of the original points, if the records have none.
    pub descriptors: Option<&'a Path>,
}

/// Name of a scheme without a name.
const UNNAMED: &str = "released";
/// The form of a user's name.
const NAME: &str = "up to 40 letters, digits, +, -, _ and . (not all)";

impl Files<'_> {
    /// Returns the name of the scheme that the file of records states.
    ///
    /// # Errors
    /// If the file cannot be read, or the name does not fit into a gate and a file name.
    pub fn scheme_name(&self) -> Result<String, Error> {
        let Some(stated) = scheme_name(self.released)? else { return Ok(UNNAMED.to_owned()) };
        check_name(&stated).map_err(|_| {
            let place = "metadata unlift, scheme";
            Error::from(FileError::new(self.released, place, NAME, &*stated)).advise("--name NAME")
        })
    }

    /// Reads the files, and checks that they belong together.
    pub fn open(&self) -> Result<Release, Error> {
        if has_images(self.released)? {
            let error = FileError::new(self.released, "", "a released map", "released images");
            let advice = "unlift recover and unlift evaluate, which take images, too";
            return Err(Error::from(error).advise(advice));
        }
        let released = read_released::<3>(self.released)?;
        let (original, secret) = read_truth::<3>(self.truth)?;
        expect_truth(self.released, &released, self.truth, &secret)?;
        let released = self.described(released, &secret)?;
        // Other schemes hide the points of this release, so that figures are of equal points.
        let (secret, kept) = secret.with_map(Some(released.fingerprint())).of_hidden();
        let rows: Vec<u32> = kept.iter().map(|id| id.0).collect();
        let points = original.reveal();
        let mut sorted = points.positions().to_vec();
        sorted.sort_unstable_by(|a, b| a.partial_cmp(b).expect("finite positions"));
        let truth_sha256 = hash_positions(&sorted);
        let positions = rows.iter().map(|&row| points.positions()[row as usize]).collect();
        let hidden = PointSet::try_new(positions, points.unit());
        let hidden = hidden.map_err(|error| FileError::core(self.truth, error))?;
        let mut prepared = Prepared::of(Original::new(hidden));
        let (of, n_left_out) = (points.len(), points.len() - rows.len());
        if n_left_out > 0 {
            let note = format!("truth: {n_left_out} of {of} points are in no record, and left out");
            prepared.remarks.notes.push(note);
        }
        (prepared.rows, prepared.input.positions) = (rows, points.positions().to_vec());
        prepared.remarks.notes.extend(released.descriptors().and_then(zeros));
        let mut row_of = vec![0; secret.n_originals()];
        for (original, row) in secret.hidden().iter().zip(secret.descriptor_row()) {
            row_of[original.index()] = *row;
        }
        if let Some(descriptors) = released.descriptors() {
            let rows = descriptors.select(&row_of);
            prepared.remarks.doubts.extend(of_descriptors(prepared.original.reveal(), &rows)?);
            // Other schemes would release the plain descriptors, which are not known here.
            prepared.descriptors = released.protected().is_none().then_some(rows);
        }
        Ok(Release { prepared, hidden: (released, secret), truth_sha256 })
    }

    /// Returns the released map with its descriptors among those of all points, if there is a file of these.
    fn described(&self, released: Released<3>, secret: &Secret) -> Result<Released<3>, Error> {
        let Some(path) = self.descriptors else { return Ok(released) };
        if released.descriptors().is_some() {
            let path = self.released.display();
            bail!("--descriptors: expected with a released map without, found some in {path}");
        }
        // Only the ids of the points are needed.
        let ids = (0..secret.n_originals() as u64).collect();
        let of_points = read::descriptors(path, &Points { ids, ..Points::default() })?;
        let mut of_rows = vec![0; secret.n_slots()];
        for (slot, &row) in secret.descriptor_row().iter().enumerate() {
            of_rows[row as usize] = secret.hidden()[slot].0;
        }
        let described = Released::try_new(
            released.obfuscation().clone(),
            released.slots_per_record(),
            released.origin(),
            released.unit(),
            Some(of_points.select(&of_rows)),
        );
        let described = described.map_err(|error| FileError::core(path, error))?;
        Ok(described.with_bounds(released.bounds()))
    }

    /// Returns what a report says of the files.
    pub fn about(&self, release: &Release) -> Result<Input, Error> {
        let points = release.prepared.original.reveal();
        let mut others = vec![("truth".to_owned(), release.truth_sha256.clone())];
        if let Some(path) = self.descriptors {
            others.push(("descriptors".to_owned(), hash_file(path)?));
        }
        Ok(Input {
            path: Some(self.released.display().to_string()),
            sha256: Some(hash_files(&[self.released])?),
            n_points: points.len() as u64,
            other_sha256: others.into_iter().collect(),
            ..Input::default()
        })
    }
}

/// Returns the slot of each original; `None` if it is not hidden.
pub(crate) fn slot_of(secret: &Secret) -> Vec<Option<usize>> {
    let mut slot_of = vec![None; secret.n_originals()];
    for (slot, original) in secret.hidden().iter().enumerate() {
        slot_of[original.index()] = Some(slot);
    }
    slot_of
}

/// Checks the name of a user's scheme, which must fit into a gate and a file name.
pub fn check_name(text: &str) -> Result<String, String> {
    let known = |c: char| c.is_ascii_alphanumeric() || "+-_.".contains(c);
    let fits = (1..=40).contains(&text.len()) && text.chars().all(known);
    if fits && text != "all" && text.starts_with(|c: char| c.is_ascii_alphanumeric()) {
        return Ok(text.to_owned());
    }
    Err(format!("expected {NAME}, found {text}"))
}

/// Returns an error if `file` belongs to another released map than `of`. A missing fingerprint is accepted.
pub fn same_map(
    file: &Path,
    found: Option<Fingerprint>,
    of: &Path,
    expected: Option<Fingerprint>,
) -> Result<(), FileError> {
    match (found, expected) {
        (Some(found), Some(expected)) if found != expected => {
            let expected = format!("{expected}, that of the released map of {}", of.display());
            Err(FileError::new(file, "fingerprint", expected, found.to_string()))
        }
        _ => Ok(()),
    }
}

/// Returns an error if the released map at `path` is not that of the truth in the file `of`, or if they differ in the number of hidden
/// points, in total or per record.
pub fn expect_truth<const D: usize>(
    path: &Path,
    released: &Released<D>,
    of: &Path,
    secret: &Secret,
) -> Result<(), FileError> {
    same_map(path, Some(released.fingerprint()), of, secret.map())?;
    for (expected, found, what) in [
        (secret.n_slots(), released.n_slots(), ""),
        (secret.slots_per_record(), released.slots_per_record(), " per record"),
    ] {
        if found != expected {
            let expected = format!("{expected} hidden points{what}, as in the truth");
            return Err(FileError::new(path, "", expected, found.to_string()));
        }
    }
    Ok(())
}
