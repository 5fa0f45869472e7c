//! What the audits share: outputs, plans, protected descriptors and painters.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use unlift::audit::{NeighborsBy, Plan, Threshold};
use unlift::descriptors::Values;
use unlift::neighbors::{Needs, Source};
use unlift::obfuscate::Protection;
use unlift::recover::{Builtin, Solver};
use unlift::{Descriptors, ErrorKind};
use unlift_audit::images::FeatureSource;
use unlift_audit::images::extraction::Wanted;
use unlift_audit::inversion::Painter;
use unlift_audit::{
    FIGURES, Finished, PAGE, Prepared, by_point, check_file_of, check_thresholds, open_audit,
};
use unlift_io::Error;
use unlift_io::atomic::{Access, make_folders, write_file};
use unlift_io::outputs::{Kind, OutputSet, Rules};
use unlift_report::junit;
use unlift_vision::network::DescriptorKind;
use unlift_vision::pictures::Inverter;

use super::common::with_threads;
use crate::args::{AuditArgs, OracleArgs, PaintArgs, ProtectArgs};
use crate::demo::photos;
use crate::exit::{Outcome, advise, usage};
use crate::output::print;
use crate::values::{NeighborSource, distinct};

/// Runs the audit `work`, writes its results and prints them. Files in `inputs` must not be
/// overwritten. `work` returns nothing if nothing could be audited.
pub fn perform(
    args: &AuditArgs,
    inputs: Vec<&Path>,
    work: impl FnOnce(OutputSet) -> crate::Result<Option<Finished>> + Send,
) -> crate::Result<Outcome> {
    let rules = Rules::new(inputs, false);
    check_junit(args, &rules)?;
    let out = open_audit(&args.out, rules.clone(), args.share_safe)?;
    let Some(finished) = with_threads(|| work(out))? else { return Ok(Outcome::Done) };
    write_junit(args, &finished, &rules)?;
    print(&finished.text())?;
    Ok(if finished.passed() { Outcome::Done } else { Outcome::GateFailed })
}

const JUNIT: &str = "--junit";

/// Checks that the file of `--junit` can be written, and that it is not a file of the report.
fn check_junit(args: &AuditArgs, rules: &Rules) -> crate::Result<()> {
    let Some(path) = &args.junit else { return Ok(()) };
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    if let Some(folder) = folder.filter(|folder| !folder.exists()) {
        // As for the folder of the report, which may be the same folder.
        let access = if args.share_safe { Access::Usual } else { Access::Private };
        make_folders(folder, access).map_err(|error| usage(format!("{JUNIT}: {error}")))?;
    }
    let target = check_file_of(JUNIT, path, Kind::Junit, rules)?;
    let out = fs::canonicalize(&args.out).unwrap_or_default();
    if [PAGE, FIGURES].iter().any(|name| out.join(name) == target) {
        let path = path.display();
        return Err(usage(format!(
            "{JUNIT}: {path}: expected a file of its own, found one of --out"
        )));
    }
    Ok(())
}

/// Writes the results of gates atomically, readable by all users.
fn write_junit(args: &AuditArgs, finished: &Finished, rules: &Rules) -> crate::Result<()> {
    let Some(path) = &args.junit else { return Ok(()) };
    check_file_of(JUNIT, path, Kind::Junit, rules)?;
    let text = junit(&finished.document);
    Ok(write_file(path, Access::Usual, |w| w.write_all(text.as_bytes()))?)
}

/// Returns the plan `usual` with the options of the oracle.
pub fn with_oracle<const D: usize>(args: &OracleArgs, mut usual: Plan<D>) -> Plan<D> {
    if !args.inlier_ratios.is_empty() {
        usual.inlier_ratios = distinct(args.inlier_ratios.clone(), |a, b| a == b);
    }
    if !args.oracle_noise.is_empty() {
        usual.oracle_noise = distinct(args.oracle_noise.clone(), |a, b| a == b);
    }
    usual.repeats = args.repeats;
    usual
}

/// Returns the requested solvers, each once, or the default.
pub fn solvers<const D: usize>(given: &[Builtin], usual: &Plan<D>) -> Vec<Arc<dyn Solver<D>>> {
    match given {
        [] => usual.solvers.clone(),
        given => Builtin::list(&distinct(given.to_vec(), |a, b| a == b)),
    }
}

/// Returns the requested thresholds, or the default. A repeated threshold is an error.
pub fn thresholds<const D: usize>(
    given: &[Threshold],
    usual: &Plan<D>,
) -> crate::Result<Vec<Threshold>> {
    let thresholds = if given.is_empty() { &usual.thresholds } else { given };
    for (at, threshold) in thresholds.iter().enumerate() {
        if thresholds[..at].iter().any(|earlier| earlier.value == threshold.value) {
            let label = &threshold.label;
            return Err(usage(format!("--thresholds: expected each once, found {label} again")));
        }
    }
    Ok(thresholds.to_vec())
}

/// Returns the thresholds of an audit of a map, and adds what is doubtful about its lengths to
/// `notes` and `doubts`.
pub fn map_thresholds(
    args: &AuditArgs,
    prepared: &Prepared,
    usual: &Plan<3>,
    (notes, doubts): (&mut Vec<String>, &mut Vec<String>),
) -> crate::Result<Vec<Threshold>> {
    let thresholds = thresholds(&args.thresholds, usual)?;
    let (points, typed) = (prepared.original.reveal(), !args.thresholds.is_empty());
    let lengths = check_thresholds(points.positions(), points.unit(), &thresholds, typed)?;
    notes.extend(lengths.note);
    doubts.extend(lengths.doubt);
    Ok(thresholds)
}

/// Returns the sources of an audit of a map, each once, and checks that options and descriptors fit
/// them. The file had `n_read` points. Notes for the user are added to `notes`; `lacking` says where
/// descriptors are expected.
pub fn neighbors(
    (requested, args): (&[NeighborSource], &OracleArgs),
    (prepared, descriptors): (&Prepared, Option<&Descriptors>),
    lacking: &str,
    (n_read, notes): (usize, &mut Vec<String>),
) -> crate::Result<Vec<NeighborsBy<3>>> {
    let mut sources = match requested {
        [] => unlift_audit::sources::usual(descriptors.is_some()),
        _ => Vec::new(),
    };
    for source in distinct(requested.to_vec(), |a, b| a == b) {
        sources.push(match source {
            NeighborSource::Oracle => NeighborsBy::Oracle,
            NeighborSource::File(path) => {
                NeighborsBy::Given(by_point(&path, prepared, n_read, notes)?)
            }
            NeighborSource::Own(named) => {
                let source = named.of_dimension()?;
                match descriptors {
                    Some(descriptors) => check_fit(&*source, descriptors)?,
                    None if source.needs() == Needs::Descriptors => {
                        let name = source.name();
                        let error = format!("--neighbors {name}: expected descriptors {lacking}");
                        return Err(usage(format!("{error}, found none")));
                    }
                    None => {}
                }
                NeighborsBy::Source(source)
            }
        });
    }
    let own = sources.iter().filter_map(NeighborsBy::source);
    notes.extend(own.filter_map(|source| source.note(prepared.original.len())));
    let files = sources.iter().filter(|by| matches!(by, NeighborsBy::Given(_))).count();
    if files > 1 {
        return Err(usage(format!("--neighbors: expected at most one file, found {files}")));
    }
    check_oracle(args, &sources)?;
    Ok(sources)
}

/// Returns an error if a source does not support this kind of descriptors.
pub fn check_fit<const D: usize>(
    source: &dyn Source<D>,
    descriptors: &Descriptors,
) -> crate::Result<()> {
    source.takes(descriptors).map_err(|error| {
        let name = source.name();
        // Errors of another kind are about the source's model and name its path.
        if error.kind() != ErrorKind::Descriptors {
            return usage(format!("--neighbors {name}: {error}"));
        }
        let (expected, found) = (error.expected(), error.found());
        let error = usage(format!("--neighbors {name}: expected {expected}, found {found}"));
        advise(error, "--neighbors similarity, which takes descriptors of any kind")
    })
}

/// Returns an error for an option of the oracle if it is none of the sources.
pub fn check_oracle<const D: usize>(
    args: &OracleArgs,
    sources: &[NeighborsBy<D>],
) -> crate::Result<()> {
    for (option, given) in [
        ("--inlier-ratios", !args.inlier_ratios.is_empty()),
        ("--oracle-noise", !args.oracle_noise.is_empty()),
    ] {
        if given && !sources.iter().any(NeighborsBy::is_oracle) {
            let found = sources.iter().map(NeighborsBy::name).collect::<Vec<_>>().join(", ");
            return Err(usage(format!(
                "{option}: expected with --neighbors oracle, found only {found}"
            )));
        }
    }
    Ok(())
}

/// Returns the protections of the command line. `kind` is that of the descriptors that they protect.
pub fn protections(
    args: &ProtectArgs,
    kind: impl FnOnce() -> crate::Result<DescriptorKind>,
) -> crate::Result<Vec<Protection>> {
    let requested = distinct(args.protect_descriptors.clone(), |a, b| a == b);
    if !requested.iter().any(Protection::needs_public) {
        return Ok(requested);
    }
    let kind = kind()?;
    let public = match &args.public_descriptors {
        Some(path) => public(path, kind, None)?,
        None => {
            let folder = photos::folder()?;
            public(folder.path(), kind, Some(photos::MIN_SCORE))?
        }
    };
    let with = |protection: Protection| match protection.needs_public() {
        true => protection.with_public(&public),
        false => Ok(protection),
    };
    Ok(requested.into_iter().map(with).collect::<Result<_, _>>()?)
}

/// Reads all descriptors of photos or of a file of features.
fn public(path: &Path, kind: DescriptorKind, min_score: Option<f32>) -> crate::Result<Descriptors> {
    let wanted = Wanted {
        option: "--public-descriptors",
        kind: path.is_dir().then_some(kind),
        min_score: min_score.filter(|_| kind != DescriptorKind::Sift),
        ..Wanted::default()
    };
    let source = FeatureSource::open(path, &wanted.extraction(path)?)?;
    let mut values = Vec::new();
    for at in 0..source.names().len() {
        let Some(descriptors) = source.get(at)?.descriptors else { continue };
        let is = DescriptorKind::of(&descriptors, "--public-descriptors")?;
        if is != kind {
            let expected = format!("descriptors of {}", kind.name());
            return Err(Error::new(path, "", expected, is.name()).into());
        }
        let mut row = vec![0.0; descriptors.dim()];
        for at in 0..descriptors.len() {
            descriptors.read_row(at, &mut row);
            values.extend_from_slice(&row);
        }
    }
    if values.is_empty() {
        return Err(Error::new(path, "", "descriptors", "none").into());
    }
    Ok(Descriptors::try_new(Values::F32(values), kind.dim())?)
}

/// Returns the kind of `descriptors`; an error about `option` if there are none.
pub fn kind(option: &str, descriptors: Option<&Descriptors>) -> crate::Result<DescriptorKind> {
    let Some(descriptors) = descriptors else {
        return Err(usage(format!("{option}: expected descriptors, found none")));
    };
    DescriptorKind::of(descriptors, option).map_err(|error| usage(error.to_string()))
}

/// Opens the painter for descriptors of `kind`: the user's network, or the known one.
pub fn painter(kind: DescriptorKind, network: Option<&PathBuf>) -> crate::Result<Painter> {
    let inverter = match network {
        Some(path) => Inverter::read(path, kind),
        None => Inverter::of(kind),
    };
    Ok(Painter::try_new(inverter?)?)
}

/// Returns the folder of photos to compare pictures of images at `path` with, if pictures are
/// requested.
pub fn photos_of_images<'a>(
    args: &'a PaintArgs,
    path: &'a Path,
) -> crate::Result<Option<&'a Path>> {
    match (&args.photos, path.is_dir()) {
        _ if args.invert.is_none() => Ok(None),
        (Some(photos), _) => Ok(Some(photos)),
        (None, true) => Ok(Some(path)),
        (None, false) => Err(usage("--invert: expected --photos, as PATH is no folder of photos")),
    }
}
