//! Protected descriptors of an audit, and the public descriptors that they use.

use std::path::Path;

use tempfile::tempdir;
use unlift::Descriptors;
use unlift::descriptors::Values;
use unlift::obfuscate::Protection;
use unlift_audit::images::FeatureSource;
use unlift_audit::images::extraction::Wanted;
use unlift_vision::features::Extraction;
use unlift_vision::network::DescriptorKind;

use crate::args::ProtectArgs;
use crate::demo;
use crate::values::distinct;

/// Returns the protections of the command line. `kind` is that of the descriptors that they protect.
pub fn protections(
    args: &ProtectArgs,
    kind: impl FnOnce() -> anyhow::Result<DescriptorKind>,
) -> anyhow::Result<Vec<Protection>> {
    let asked = distinct(args.protect_descriptors.clone(), |a, b| a == b);
    if !asked.iter().any(Protection::needs_public) {
        return Ok(asked);
    }
    let kind = kind()?;
    let public = match &args.public_descriptors {
        Some(path) => public(path, kind, None)?,
        None => {
            let folder = tempdir()?;
            demo::write_photos(folder.path())?;
            public(folder.path(), kind, Some(demo::MIN_SCORE))?
        }
    };
    let with = |one: Protection| match one.needs_public() {
        true => one.with_public(&public),
        false => Ok(one),
    };
    Ok(asked.into_iter().map(with).collect::<Result<_, _>>()?)
}

/// Reads all descriptors of photos or of a file of features.
fn public(
    path: &Path,
    kind: DescriptorKind,
    min_score: Option<f32>,
) -> anyhow::Result<Descriptors> {
    let folder = path.is_dir();
    let wanted = Wanted {
        option: "--public-descriptors",
        kind: folder.then_some(kind),
        min_score: min_score.filter(|_| kind != DescriptorKind::Sift),
        ..Wanted::default()
    };
    let extraction: Extraction = wanted.extraction(path)?;
    let source = FeatureSource::open(path, &extraction)?;
    let mut values = Vec::new();
    for at in 0..source.names().len() {
        let Some(found) = source.get(at)?.descriptors else { continue };
        let is = DescriptorKind::of(&found, "--public-descriptors")?;
        if is != kind {
            let expected = format!("descriptors of {}", kind.name());
            return Err(unlift_io::Error::new(path, "", expected, is.name()).into());
        }
        let mut row = vec![0.0; found.dim()];
        for at in 0..found.len() {
            found.read_row(at, &mut row);
            values.extend_from_slice(&row);
        }
    }
    if values.is_empty() {
        return Err(unlift_io::Error::new(path, "", "descriptors", "none").into());
    }
    Ok(Descriptors::try_new(Values::F32(values), kind.dim())?)
}
