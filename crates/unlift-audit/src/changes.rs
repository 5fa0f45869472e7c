//! Changes under which schemes are audited, too: mitigations, and protections of descriptors.

use std::path::Path;

use unlift::Descriptors;
use unlift::descriptors::Values;
use unlift::obfuscate::{Change, Mitigation, Protection};
use unlift_io::Error as FileError;
use unlift_vision::network::DescriptorKind;

use crate::document::distinct;
use crate::images::{FeatureSource, Wanted, kind_of};
use crate::maps::Prepared;
use crate::{Error, bail};

/// Returns the changes by mitigations of a map, which may be audited in tiles.
///
/// # Errors
/// If the map lacks the tracks or descriptors that a mitigation needs.
pub fn mitigations(
    requested: &[Mitigation],
    prepared: &Prepared,
    in_tiles: bool,
) -> Result<Vec<Change>, Error> {
    let tracks = Some(&prepared.cameras.tracks).filter(|tracks| !tracks.is_empty());
    let change = |mitigation: &Mitigation| {
        let lacks_tracks = mitigation.needs_tracks() && (tracks.is_none() || in_tiles);
        let lacks_rows = mitigation.changes_descriptors() && prepared.descriptors.is_none();
        let (expected, name) = match (lacks_tracks, lacks_rows) {
            (true, _) => ("a COLMAP model with tracks, not in tiles", mitigation.name()),
            (false, true) => ("descriptors (--descriptors FILE)", mitigation.name()),
            (false, false) => return Ok(Change::Mitigation(mitigation.clone(), tracks.cloned())),
        };
        bail!("--mitigate {name}: expected {expected}, found none")
    };
    requested.iter().map(change).collect()
}

/// Returns the requested protections of a map; `public` returns the descriptors that owner and attacker know.
///
/// # Errors
/// If the map has no descriptors, and those of [`protections`].
pub fn protections_of_map(
    requested: &[Protection],
    prepared: &Prepared,
    public: impl FnOnce(DescriptorKind) -> Result<Descriptors, Error>,
) -> Result<Vec<Protection>, Error> {
    const OPTION: &str = "--protect-descriptors";
    if let (Some(first), None) = (requested.first(), &prepared.descriptors) {
        bail!("{OPTION} {}: expected descriptors (--descriptors FILE), found none", first.name());
    }
    protections(requested, || kind_of(OPTION, prepared.descriptors.as_ref()), public)
}

/// Returns the requested protections. `kind` is that of the descriptors that they protect, and `public` returns the descriptors that
/// owner and attacker know.
pub fn protections(
    requested: &[Protection],
    kind: impl FnOnce() -> Result<DescriptorKind, Error>,
    public: impl FnOnce(DescriptorKind) -> Result<Descriptors, Error>,
) -> Result<Vec<Protection>, Error> {
    let requested = distinct(requested.to_vec(), |a, b| a == b);
    if !requested.iter().any(Protection::needs_public) {
        return Ok(requested);
    }
    let public = public(kind()?)?;
    let with = |protection: Protection| match protection.needs_public() {
        true => protection.with_public(&public),
        false => Ok(protection),
    };
    Ok(requested.into_iter().map(with).collect::<Result<_, _>>()?)
}

/// Reads all descriptors of photos or of a file of features; `min_score` is that of features in photos.
pub fn public_descriptors(
    path: &Path,
    kind: DescriptorKind,
    min_score: Option<f32>,
) -> Result<Descriptors, Error> {
    const OPTION: &str = "--public-descriptors";
    let wanted = Wanted {
        option: OPTION,
        kind: path.is_dir().then_some(kind),
        min_score: min_score.filter(|_| kind != DescriptorKind::Sift),
        ..Wanted::default()
    };
    let source = FeatureSource::open(path, &wanted.extraction(path)?)?;
    let mut values = Vec::new();
    for at in 0..source.names.len() {
        let Some(descriptors) = source.get(at)?.descriptors else { continue };
        let is = DescriptorKind::of(&descriptors, OPTION)?;
        if is != kind {
            let expected = format!("descriptors of {}", kind.name());
            return Err(FileError::new(path, "", expected, is.name()).into());
        }
        values.extend(descriptors.rows().flatten());
    }
    if values.is_empty() {
        return Err(FileError::new(path, "", "descriptors", "none").into());
    }
    Ok(Descriptors::try_new(Values::F32(values), kind.dim())?)
}
