//! Localization with the cameras of a map: what every scheme costs.

pub mod held_out;
pub(crate) mod matches;

use std::path::PathBuf;
use std::sync::Arc;

use unlift::audit::Plan;
use unlift::geometry::camera::PoseError;
use unlift::localization::{Localization, View, unprotected, with_map, with_queries};
use unlift::obfuscate::{Change, Changed, Protection, SCHEMES, Scheme, SchemeOptions, obfuscate};
use unlift::seed::Key;
use unlift_report::document::{self as report, UNPROTECTED};

use crate::maps::Prepared;
use crate::{Error, Progress};

/// Localization in an audit.
#[derive(Clone, Debug, Default)]
pub struct Localize {
    /// Photos or features of the images: also localizes held-out images. Every image with an
    /// index that is half of the number modulo the number is held out.
    pub held_out: Option<(PathBuf, usize)>,
    /// Protections of the descriptors of queries, each with every scheme on keypoints.
    pub protections: Vec<Protection>,
}

#[derive(Clone, Copy)]
enum Protects<'a> {
    Nothing,
    Map(&'a dyn Scheme<3>),
    Queries(&'a dyn Scheme<2>),
}

/// Returns the accuracy under every scheme of `plan` and under every scheme on queries, after that
/// of the map itself, and notes. Empty without views.
pub(crate) fn of_schemes(
    localize: &Localize,
    prepared: &Prepared,
    plan: &Plan<3>,
    progress: &dyn Progress,
) -> Result<(Vec<report::Localization>, Vec<String>), Error> {
    let Prepared { original, cameras, .. } = prepared;
    let views: &[View] = &cameras.views;
    if views.is_empty() {
        return Ok(Default::default());
    }
    let positions = original.reveal().positions();
    let base = unprotected(views, positions);
    let row = |scheme: &str, changes_descriptors: bool, errors: &[Option<PoseError>]| {
        let bound = Localization::of(errors, &base);
        let finite = |value: f64| Some(value).filter(|value| value.is_finite());
        report::Localization {
            scheme: scheme.to_owned(),
            multiple: finite(bound.multiple),
            center_error: finite(bound.center),
            rotation_error_degrees: finite(bound.rotation_degrees),
            failed_percent: bound.failed_percent,
            changes_descriptors,
            ..Default::default()
        }
    };
    let changes_descriptors =
        |changes: Vec<&Change>| changes.into_iter().any(Change::changes_descriptors);
    let key = Key::from_seed(plan.seed);
    let mut rows = vec![(Protects::Nothing, row(UNPROTECTED, false, &base))];
    for scheme in &plan.schemes {
        // A scheme that cannot hide the map is among those that were not audited.
        let Ok((released, secret)) = obfuscate(&**scheme, original, None, &key) else { continue };
        let errors = with_map(views, positions, &released, &secret);
        let row = row(scheme.name(), changes_descriptors(scheme.changes()), &errors);
        rows.push((Protects::Map(&**scheme), row));
    }
    // All schemes on keypoints, and each under every protection.
    let options = SchemeOptions::usual(unlift::Unit::Pixel);
    let mut queries: Vec<Arc<dyn Scheme<2>>> =
        SCHEMES.iter().filter_map(|entry| entry.of_dimension(&options)).collect();
    let changes = localize.protections.iter().cloned().map(Change::Protection);
    queries.extend(Changed::all(&queries, &changes.collect::<Vec<_>>()));
    for scheme in &queries {
        let errors = with_queries(views, positions, &**scheme, &key)?;
        let mut row = row(scheme.name(), changes_descriptors(scheme.changes()), &errors);
        row.of_queries = true;
        rows.push((Protects::Queries(&**scheme), row));
    }
    let mut notes = Vec::new();
    if let Some((path, nth)) = &localize.held_out {
        let mut held = held_out::Held::open(path, *nth, cameras, original, progress)?;
        notes.push(held.note());
        progress.say(&format!("note: {}", held.note()));
        let limits: Vec<(String, f64, f64)> = match original.reveal().unit() {
            unlift::Unit::Meter => [(0.05, 5.0), (0.25, 2.0), (0.5, 5.0)]
                .map(|(m, angle)| (format!("{:.0} cm, {angle} deg", 100.0 * m), m, angle))
                .to_vec(),
            // Without a scale, multiples of the unprotected bound.
            _ => {
                let bound = rows[0].1.center_error.unwrap_or(0.0);
                [10.0, 30.0, 100.0]
                    .map(|times| (format!("{times} times the bound, 5 deg"), times * bound, 5.0))
                    .to_vec()
            }
        };
        let (n_rows, mut base) = (rows.len(), None);
        for (at, (protects, row)) in rows.iter_mut().enumerate() {
            progress.show(at, n_rows, &format!("localization, {}", row.scheme));
            let problems = match protects {
                Protects::Nothing => held.unprotected(),
                Protects::Map(scheme) => held.with_map(*scheme, &key)?,
                Protects::Queries(scheme) => held.with_queries(*scheme, &key)?,
            };
            let errors = held_out::locate(&problems, plan.seed);
            // The first row is that of the map itself.
            let of_map = base.as_ref().unwrap_or(&errors);
            row.held_out = Some(held_out::summary(&problems, [&errors, of_map], &limits));
            base.get_or_insert(errors);
        }
    }
    Ok((rows.into_iter().map(|(_, row)| row).collect(), notes))
}
