//! `unlift demo`: protects and attacks two photos and a map, without data of the user.

pub mod photos;

use std::path::Path;
use std::sync::Arc;

use serde_json::json;
use unlift::audit::{Measure, NeighborsBy, Plan};
use unlift::neighbors::Geometric;
use unlift::recover::Builtin;
use unlift::truth::Original;
use unlift::{PointSet, Unit, synthetic};
use unlift_audit::images::{FeatureSource, Opened};
use unlift_audit::inversion::Inversion;
use unlift_audit::{
    Audit, Audited, FIGURES, Images, Input, Map, Output, PAGE, Prepared, headline, refused,
};
use unlift_io::atomic::Access;
use unlift_io::hash::hash_positions;
use unlift_io::outputs::{Kind, OutputSet, Rules};
use unlift_report::Shares;
use unlift_report::document::Input as About;
use unlift_vision::features::Extraction;
use unlift_vision::network::{DescriptorKind, Learned};

use crate::args::DemoArgs;
use crate::commands::common::with_threads;
use crate::output::{command_line, print, table};
use crate::progress::{Progress, Stderr};

/// Seed of the synthetic room.
const SEED: u64 = 0;
/// Number of points of its map.
const N_POINTS: usize = 5_000;
/// Inlier ratios of the oracle for the map.
const RATIOS: [f64; 2] = [0.5, 0.1];
/// Page and JSON file of the photos; the map has the audit's usual names.
const OF_PHOTOS: [&str; 2] = ["photos.html", "photos.json"];

pub fn run(args: &DemoArgs) -> crate::Result<()> {
    let files = [
        (PAGE, Kind::Page),
        (FIGURES, Kind::AuditJson),
        (OF_PHOTOS[0], Kind::Page),
        (OF_PHOTOS[1], Kind::AuditJson),
    ];
    let rules = Rules::new([], false);
    let mut out = OutputSet::create(&args.out, rules, Access::Private, &files).map_err(refused)?;
    let text = with_threads(|| {
        let output = || Output { command: Some(command_line()), ..Output::new(&args.out) };
        let attacking = Progress::uncounted(args.quiet, "attacking two protected photos");
        let photos = photos(output())?;
        drop(attacking);
        let _attacking = Progress::uncounted(args.quiet, "attacking a protected map");
        let map = map(output())?;
        photos.stage(&mut out, OF_PHOTOS, false)?;
        let (of_photos, of_map) = (photos.shares(), map.shares());
        let title = "Two photos: a cat and a cup of coffee";
        let map = map.opening_with(&photos, title, OF_PHOTOS[0]);
        map.stage(&mut out, [PAGE, FIGURES], false)?;
        out.commit()?;
        Ok(summary(of_photos, of_map, &args.out.join(PAGE)))
    })?;
    print(&text)
}

fn photos(output: Output) -> crate::Result<Audited> {
    let folder = photos::folder()?;
    let extraction = Extraction { min_score: photos::MIN_SCORE, ..Extraction::ALIKED };
    let source = FeatureSource::open(folder.path(), &extraction)?;
    let opened = Opened::of(source, folder.path(), None);
    let of = (&opened.source, &opened.chosen[..], folder.path());
    let inversion = Arc::new(Inversion::open(of, DescriptorKind::Aliked, None, None)?);
    let usual = Plan::new(Unit::Pixel);
    let plan = Plan {
        neighbors: vec![NeighborsBy::Source(Arc::new(Learned))],
        // Pictures are painted of every solver.
        solvers: vec![Arc::new(Builtin::Joint)],
        k: 20,
        headline: headline(&usual.thresholds),
        measures: vec![Arc::clone(&inversion) as Arc<dyn Measure<2>>],
        ..usual
    };
    let inversion = Some(inversion);
    let images = Images { opened: &opened, plan, draws: true, photos: None, inversion };
    let mut audit = Audit::new(output);
    audit.options.insert("features".into(), json!(DescriptorKind::Aliked.name()));
    audit.options.insert("min_score".into(), json!(photos::MIN_SCORE));
    let mut audited = audit.run(&Input::Images(images), &Stderr)?;
    // The temporary path is meaningless.
    audited.document.input.path = Some("Two photos of the demo".to_owned());
    Ok(audited)
}

fn map(output: Output) -> crate::Result<Audited> {
    let room = synthetic::room(SEED, N_POINTS);
    let sha256 = hash_positions(&room.points);
    let original = Original::new(PointSet::try_new(room.points, Unit::Meter)?);
    let mut prepared = Prepared::of(original);
    prepared.input.cameras = room.cameras.iter().map(|camera| camera.center).collect();
    prepared.input.up = Some([0.0, 0.0, 1.0]);
    let map = Map::new(&prepared);
    let plan = Plan {
        neighbors: vec![NeighborsBy::Oracle, NeighborsBy::Source(Arc::new(Geometric))],
        inlier_ratios: RATIOS.to_vec(),
        ..map.plan.clone()
    };
    let mut audit = Audit::new(output);
    audit.options.insert("room".into(), json!({ "seed": SEED }));
    audit.about = About {
        path: Some("The map of a made-up room".to_owned()),
        sha256: Some(sha256),
        n_points: prepared.original.len() as u64,
        scale_m_per_unit: Some(1.0),
        unit_in_map_units: Some(1.0),
        ..About::default()
    };
    audit.run(&Input::Map(Map { plan, ..map }), &Stderr)
}

/// Formats a short summary for users who do not know the schemes.
fn summary(photos: Vec<Shares>, map: Vec<Shares>, page: &Path) -> String {
    let percent = |share: Option<f64>| share.map_or("-".to_owned(), |x| format!("{x:.1} %"));
    let of_photos = photos.into_iter().map(|row| {
        let back = format!("{} of the keypoints came back", percent(row.today));
        vec![format!("  {}", row.scheme), row.title, back, row.pictures.unwrap_or_default()]
    });
    let of_map = map.into_iter().map(|row| {
        vec![format!("  {}", row.scheme), row.title, percent(row.today), percent(row.known)]
    });
    let head = ["", "points that came back:", "today", "if half of the neighbors were known"];
    let mut map_rows = vec![head.map(str::to_owned).to_vec()];
    map_rows.extend(of_map);
    format!(
        "Two photos, protected by three published schemes, attacked from the protected data alone:\n{}\
         The map of a room, protected by seven published schemes:\n{}\
         Photos, pictures that came back and all figures: {}\n",
        table(&of_photos.collect::<Vec<_>>(), &[1, 3]),
        table(&map_rows, &[1]),
        unlift::OneLine(page.display())
    )
}
