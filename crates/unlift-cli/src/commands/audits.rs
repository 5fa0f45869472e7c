//! The audits: arguments to an `Audit`, which is run and printed.

use std::collections::BTreeMap;
use std::iter;
use std::path::PathBuf;
use std::sync::Arc;

use serde_json::json;
use unlift::Unit;
use unlift::audit::{Measure, NeighborsBy, Plan, scheme_called};
use unlift::geometry::camera::PoseError;
use unlift::neighbors::sources::Named;
use unlift::obfuscate::{Change, Changed, Entry, SCHEMES, SchemeOptions};
use unlift::recover::Builtin;
use unlift_audit::changes::{mitigations, protections, protections_of_map};
use unlift_audit::images::{FeatureSource, Opened, Opening};
use unlift_audit::inversion::{Inversion, MapInversion};
use unlift_audit::localization::Localize;
use unlift_audit::{
    Again, Audit, Audited, Hidden, Images, Input, Map, Maps, Output, Preparation, Prepared,
    Progress as _, Request, Sequence, Tiles, bail, by_point, check_thresholds, distinct, released,
};
use unlift_io::hash::hash_file;
use unlift_io::outputs::Rules;
use unlift_io::stage::published_positions;
use unlift_vision::features::photo::Turn;

use super::common::{all_could_be, open_map, public, with_threads};
use crate::Error;
use crate::args::{
    AuditAgainArgs, AuditArgs, AuditImagesArgs, AuditMapArgs, AuditReleasedArgs, AuditSequenceArgs,
    OracleArgs, PaintArgs, SolverArgs,
};
use crate::output::{command_line, print};
use crate::progress::Progress;
use crate::values::NeighborSource;

/// Lets `work` complete and run an audit of `path`, writes its results and prints them. Returns whether every gate held. `path` and
/// the files in `more` must not be overwritten.
///
/// # Errors
/// Among others, if images of `path` could not be used; the results without them are written.
fn perform<'a>(
    args: &AuditArgs,
    path: &'a PathBuf,
    more: impl Iterator<Item = &'a PathBuf>,
    work: impl FnOnce(Audit) -> crate::Result<Audited> + Send,
) -> crate::Result<bool> {
    let output = Output {
        share_safe: args.share_safe,
        junit: args.junit.clone(),
        command: Some(command_line()),
        ..Output::new(&args.out)
    };
    let inputs = iter::once(path).chain(more).map(PathBuf::as_path);
    let files = output.open(Rules::new(inputs, false))?;
    let audit = Audit { gates: args.gate.clone(), ..Audit::new(output) };
    let finished = with_threads(|| work(audit)?.write(files))?;
    print(&finished.text())?;
    if let Some(count) = finished.document.input.images {
        all_could_be("used", path, count.used as usize, count.unusable as usize)?;
    }
    Ok(finished.passed())
}

/// Returns a request of what several audits share.
fn request<const D: usize>(
    args: &AuditArgs,
    k: u16,
    schemes: &[&Entry],
    oracle: Option<&OracleArgs>,
    unit: Unit,
) -> Request<D> {
    let mut request = Request::new(usize::from(k), args.seed);
    let (plan, options) = (&mut request.plan, SchemeOptions::usual(unit));
    plan.thresholds = args.thresholds.clone();
    plan.schemes = schemes.iter().filter_map(|entry| entry.of_dimension(&options)).collect();
    if let Some(oracle) = oracle {
        plan.inlier_ratios = oracle.inlier_ratios.clone();
        plan.oracle_noise = oracle.oracle_noise.clone();
        plan.repeats = oracle.repeats;
    }
    request
}

/// Adds the sources and solvers of a map, and what is doubtful about a file of lists to its notes.
fn add_solvers(
    plan: &mut Plan<3>,
    args: &SolverArgs,
    prepared: &mut Prepared,
) -> crate::Result<()> {
    for source in distinct(args.neighbors.clone(), NeighborSource::eq) {
        plan.neighbors.push(match source {
            NeighborSource::Oracle => NeighborsBy::Oracle,
            NeighborSource::Own(named) => NeighborsBy::Source(named.of_dimension()?),
            NeighborSource::File(path) => NeighborsBy::Given(by_point(&path, prepared)?),
        });
    }
    plan.solvers = Builtin::list(&args.solver);
    plan.records_alone = !args.no_records_alone;
    Ok(())
}

fn hashes_of_lists(args: &SolverArgs) -> crate::Result<BTreeMap<String, String>> {
    let hash = |path: &PathBuf| Ok(("neighbors".to_owned(), hash_file(path)?));
    NeighborSource::files(&args.neighbors).map(hash).collect()
}

const NO_RECORDS_ALONE: &str =
    "--no-records-alone: the attack on the records alone was not tried; it may recover more";

/// The inlier ratio of the oracle whose pictures are painted by default.
const PAINTED_RATIO: f64 = 0.5;

pub fn map(args: &AuditMapArgs) -> crate::Result<bool> {
    let more = args.paint.inputs().chain(&args.localize).chain(&args.protect.public_descriptors);
    let more = more.chain(&args.map.descriptors);
    let more = more.chain(NeighborSource::files(&args.solvers.neighbors));
    perform(&args.audit, &args.path, more, |audit| {
        let AuditArgs { seed, quiet, .. } = args.audit;
        let mut prepared =
            open_map(&args.path, &args.map, (true, args.uses_descriptors()), (seed, quiet))?;
        let progress = Progress::new(quiet);
        let has_ratios = args.full || !args.oracle.inlier_ratios.is_empty();
        let inversion = match &args.paint.invert {
            Some(network) => {
                let (photos, max_images) = (args.paint.photos.as_deref(), args.max_images.get());
                let (network, ratio) = (network.as_deref(), (!has_ratios).then_some(PAINTED_RATIO));
                let opened =
                    MapInversion::open(&prepared, photos, network, max_images, ratio, &progress)?;
                Some(Arc::new(opened))
            }
            None => None,
        };
        prepared.check_extent(args.expect_extent, args.map.scale)?;
        let protections =
            protections_of_map(&args.protect.protect_descriptors, &prepared, |kind| {
                public(args.protect.public_descriptors.as_deref(), kind)
            })?;
        if args.solvers.no_records_alone {
            prepared.remarks.notes.push(NO_RECORDS_ALONE.to_owned());
        }
        let (unit, n_points) = (prepared.original.reveal().unit(), prepared.original.len());
        let n_together = args.tile_points.map_or(n_points, |max| n_points.min(max.get()));
        let mut usual = Plan::new(unit).for_map(n_together, usize::from(args.map.k));
        if args.full {
            usual.inlier_ratios = Plan::<3>::new(unit).inlier_ratios;
            usual.solvers = Builtin::list(&[Builtin::Joint, Builtin::Consensus, Builtin::Ransac]);
        }
        let oracle = Some(&args.oracle);
        let mut request = request(&args.audit, args.map.k, &args.schemes, oracle, unit);
        add_solvers(&mut request.plan, &args.solvers, &mut prepared)?;
        if args.quick {
            request.quick(&usual, prepared.descriptors.is_some())?;
        }
        request.changes = mitigations(&args.mitigate, &prepared, args.tile_points.is_some())?;
        request.changes.extend(protections.iter().cloned().map(Change::Protection));
        let mut audit = audit.of_map(&prepared);
        let descriptors = (prepared.descriptors.as_ref(), "(--descriptors FILE)");
        let points = prepared.original.reveal();
        let mut plan = request.of_map(usual, points, descriptors, &mut audit.remarks)?;
        if let Some(inversion) = &inversion {
            let attacks = match has_ratios {
                true => plan.rows_per_scheme(),
                false => plan.neighbors.len() * plan.solvers.len(),
            };
            let (schemes, photos) = (plan.schemes.len(), inversion.n_photos());
            let n = photos * schemes * attacks * plan.repeats as usize;
            progress.say(&format!(
                "note: {n} pictures: {photos} photos x {attacks} attacks x {schemes} schemes"
            ));
            plan.measures.push(Arc::clone(inversion) as Arc<dyn Measure<3>>);
        }
        let mut map = Map { plan, inversion, ..Map::new(&prepared) };
        if let Some(path) = &args.localize {
            if prepared.cameras.views.is_empty() {
                bail!("--localize: expected a COLMAP model with cameras and tracks, found none");
            }
            let held_out = Some((path.clone(), args.hold_out.get()));
            map.localize = Some(Localize { held_out, protections });
        }
        let input = match args.tile_points {
            Some(max) => Input::Tiles(map, Tiles { max_points: max.get(), only: None }),
            None => Input::Map(map),
        };
        audit.about = prepared.about(&args.path)?;
        audit.about.other_sha256.extend(hashes_of_lists(&args.solvers)?);
        audit.options = args.record();
        audit.run(&input, &progress)
    })
}

pub fn released(args: &AuditReleasedArgs) -> crate::Result<bool> {
    let lists = NeighborSource::files(&args.solvers.neighbors);
    let more = lists.chain([&args.truth]).chain(&args.descriptors);
    let files = released::Files {
        released: &args.released,
        truth: &args.truth,
        descriptors: args.descriptors.as_deref(),
    };
    perform(&args.audit, &args.released, more, |audit| {
        let name = args.name.clone().map_or_else(|| files.scheme_name(), Ok)?;
        let release = files.open()?;
        let about = files.about(&release)?;
        let released::Release { mut prepared, hidden, .. } = release;
        prepared.check_extent(args.expect_extent, None)?;
        let progress = Progress::new(args.audit.quiet);
        let (unit, n_points) = (prepared.original.reveal().unit(), prepared.original.len());
        let usual = Plan::new(unit).for_map(n_points, usize::from(args.k));
        let oracle = Some(&args.oracle);
        let mut request = request(&args.audit, args.k, &args.schemes, oracle, unit);
        add_solvers(&mut request.plan, &args.solvers, &mut prepared)?;
        if request.plan.schemes.iter().any(|scheme| scheme.name() == name) {
            bail!(
                "--schemes: expected other schemes than that of the release, found {name} (or --name NAME)"
            );
        }
        request.plan.schemes.insert(0, scheme_called(&name));
        let mut audit = audit.of_map(&prepared);
        let descriptors = (hidden.0.descriptors(), "in the released map");
        let points = prepared.original.reveal();
        let plan = request.of_map(usual, points, descriptors, &mut audit.remarks)?;
        let map = Map { plan, ..Map::new(&prepared) };
        let published = published_positions(&args.released)?;
        let input = Input::Released(map, Hidden { release: &hidden, published });
        audit.about = about;
        audit.about.other_sha256.extend(hashes_of_lists(&args.solvers)?);
        audit.options.insert("released".into(), json!(true));
        // The file does not state it, so it may be a scheme of the user's own.
        audit.options.extend(args.name.iter().map(|name| ("name".into(), json!(name))));
        audit.run(&input, &progress)
    })
}

pub fn images(args: &AuditImagesArgs) -> crate::Result<bool> {
    let oracle = Some(&args.oracle);
    let mut request = request(&args.audit, args.k, &args.schemes, oracle, Unit::Pixel);
    request.plan.solvers = Builtin::list(&args.solver);
    for source in &args.neighbors {
        request.plan.neighbors.push(match source {
            NeighborSource::Own(named) => NeighborsBy::Source(named.of_dimension()?),
            NeighborSource::Oracle | NeighborSource::File(_) => NeighborsBy::Oracle,
        });
    }
    let mut plan = request.plan(Plan::new(Unit::Pixel), true)?;
    plan.check_for_many().map_err(|error| Error::request(error.to_string()))?;
    let more = args.paint.inputs().chain(&args.protect.public_descriptors);
    perform(&args.audit, &args.path, more, |audit| {
        let paints = args.paint.invert.is_some();
        let opening = Opening {
            wanted: args.extraction.wanted(),
            max_images: args.max_images.map(|max| max.get()),
            photos: args.paint.photos.as_deref(),
            paints,
            uses_descriptors: paints || !args.protect.protect_descriptors.is_empty(),
            is_usual: args.neighbors.is_empty(),
        };
        let opened = Opened::open(&args.path, &opening, &mut plan)?;
        let inversion = inversion(&args.paint, &opened)?.map(Arc::new);
        let protections = protections(
            &args.protect.protect_descriptors,
            || opened.source.kind("--protect-descriptors", &opened.chosen),
            |kind| public(args.protect.public_descriptors.as_deref(), kind),
        )?;
        let changes: Vec<Change> = protections.into_iter().map(Change::Protection).collect();
        plan.schemes.extend(Changed::all(&plan.schemes, &changes));
        let measure = inversion.clone().map(|measure| measure as Arc<dyn Measure<2>>);
        plan.measures.extend(measure);
        let progress = Progress::new(args.audit.quiet);
        let photos = args.paint.photos.clone();
        let images = Images { opened: &opened, plan, draws: true, photos, inversion };
        Audit { options: args.record(), ..audit }.run(&Input::Images(images), &progress)
    })
}

/// Opens the painter of pictures, if it is requested.
fn inversion(args: &PaintArgs, opened: &Opened) -> crate::Result<Option<Inversion>> {
    let Some(network) = &args.invert else { return Ok(None) };
    let Opened { source, path, chosen } = opened;
    let (kind, photos) = (source.kind("--invert", chosen)?, args.photos.as_deref());
    Ok(Some(Inversion::open((source, chosen, path), kind, photos, network.as_deref())?))
}

pub fn sequence(args: &AuditSequenceArgs) -> crate::Result<bool> {
    let usual = Plan::new(Unit::Pixel);
    let mut request = request(&args.audit, usual.k as u16, &args.schemes, None, Unit::Pixel);
    let mitigations = distinct(args.mitigate.clone(), |a, b| a.name() == b.name()).into_iter();
    request.changes = mitigations.map(|change| Change::Mitigation(change, None)).collect();
    // Poses and links are not exact to a pixel.
    let thresholds = usual.thresholds[1..].to_vec();
    let plan = request.plan(Plan { thresholds, ..usual }, false)?;
    if args.poses.is_some() && args.scale.is_none() {
        bail!("--poses perturbed: expected --scale, meters per unit of the model");
    }
    let pose_error = args.poses.zip(args.scale).map(|((cm, rotation_degrees), scale)| PoseError {
        center: 0.01 * cm / scale,
        rotation_degrees,
    });
    if args.paint.invert.is_some() && args.audit.share_safe {
        bail!("--invert: expected without --share-safe, as pictures show the place");
    }
    let more = iter::once(&args.model).chain(args.paint.inputs());
    perform(&args.audit, &args.path, more, |audit| {
        let extraction = args.extraction.wanted().extraction(&args.path)?;
        // A model is of the photos as they are stored.
        let source = FeatureSource::open(&args.path, &extraction)?.with_turn(Turn::AsStored);
        let opened = Opened::of(source, &args.path, None);
        let inversion = inversion(&args.paint, &opened)?;
        let mut queries = args.queries.clone();
        queries.sort_unstable();
        queries.dedup();
        let progress = Progress::new(args.audit.quiet);
        let sequence = Sequence {
            model: &args.model,
            opened: &opened,
            plan,
            lists: args.neighbors.as_ref().map(Named::of_dimension).transpose()?,
            queries,
            pose_error,
            inversion,
        };
        Audit { options: args.record(), ..audit }.run(&Input::Sequence(sequence), &progress)
    })
}

pub fn again(args: &AuditAgainArgs) -> crate::Result<bool> {
    let more = iter::once(&args.b).chain(&args.descriptors);
    perform(&args.audit, &args.a, more, |audit| {
        let preparation = Preparation { scale: args.scale, ..Preparation::default() };
        let reading = Progress::uncounted(args.audit.quiet, "reading the maps");
        let maps = Maps::open([&args.a, &args.b], &args.descriptors, &preparation)?;
        drop(reading);
        let (points, typed) = (maps.first.original.reveal(), !args.audit.thresholds.is_empty());
        let usual = Plan::new(points.unit());
        let mut request = request(&args.audit, usual.k as u16, &[], None, points.unit());
        request.plan.records_alone = !args.no_records_alone;
        let plan = request.plan(usual, false)?;
        let mut audit = audit.of_map(&maps.first);
        check_thresholds(&mut audit.remarks, points, &plan.thresholds, typed)?;
        let options = SchemeOptions::usual(points.unit());
        let pairs = match args.schemes.as_slice() {
            [] => SCHEMES.iter().map(|entry| [entry; 2]).collect(),
            given => distinct(given.to_vec(), |a, b| a.map(|e| e.name) == b.map(|e| e.name)),
        };
        let pairs = pairs
            .into_iter()
            .filter_map(|[a, b]| Some([a.of_dimension(&options)?, b.of_dimension(&options)?]));
        let progress = Progress::new(args.audit.quiet);
        let input = Input::Again(Again { maps: &maps, pairs: pairs.collect(), plan });
        audit.about = maps.about(&args.a)?;
        audit.options.insert("again".into(), json!(args.b.display().to_string()));
        audit.run(&input, &progress)
    })
}
