//! Localization: how precisely a camera can be placed with a protected map or a protected query.
//!
//! Localization accuracy is the price of protection. Of every scheme it is computed as an information bound, and, with photos, measured on
//! images that the map is made without.

mod bound;
mod cost;
mod estimate;
mod held_out;
mod matches;

pub use bound::{View, free_directions, unprotected, with_map, with_queries};
pub use cost::{FEWEST_HELD_OUT, HeldOut, Localization, UNPROTECTED};
pub use estimate::{Match, OnLine, estimate};
pub use held_out::{Held, NEAR, Photo, Problem};
pub use matches::{Unit32, mutual};

use std::sync::Arc;

use crate::geometry::camera::PoseError;
use crate::obfuscate::{Change, Changed, Protection, SCHEMES, Scheme, SchemeOptions, obfuscate};
use crate::seed::Key;
use crate::truth::Original;
use crate::{Error, Unit};
use unlift_attack::parallel;

enum Protects<'a> {
    Nothing,
    Map(&'a dyn Scheme<3>),
    Queries(&'a dyn Scheme<2>),
}

/// Returns the accuracy under every one of `schemes`, and under every scheme on keypoints of queries, also with `protections` of their
/// descriptors, after that of the map itself. Schemes that cannot hide the map are left out. `steps` is called with the number of rows
/// that are measured on the images of `held`, of all rows, and with the next scheme.
///
/// # Errors
/// If a scheme on keypoints fails, or a scheme on the descriptors of `held`.
pub fn of_schemes(
    (original, views): (&Original<3>, &[View]),
    schemes: &[Arc<dyn Scheme<3>>],
    protections: &[Protection],
    held: Option<&mut Held<'_>>,
    seed: u64,
    steps: impl Fn(usize, usize, &str),
) -> Result<Vec<Localization>, Error> {
    let (points, key) = (original.reveal(), Key::from_seed(seed));
    let positions = points.positions();
    let base = unprotected(views, positions);
    let row = |name: &str, changes: Vec<&Change>, errors: &[Option<PoseError>]| Localization {
        changes_descriptors: changes.into_iter().any(Change::changes_descriptors),
        ..Localization::of(name, errors, &base)
    };
    let mut rows = vec![(Protects::Nothing, row(UNPROTECTED, Vec::new(), &base))];
    for scheme in schemes {
        let Ok((released, secret)) = obfuscate(&**scheme, original, None, &key) else { continue };
        let errors = with_map(views, positions, &released, &secret);
        rows.push((Protects::Map(&**scheme), row(scheme.name(), scheme.changes(), &errors)));
    }
    let options = SchemeOptions::usual(Unit::Pixel);
    let mut queries: Vec<Arc<dyn Scheme<2>>> =
        SCHEMES.iter().filter_map(|entry| entry.of_dimension(&options)).collect();
    let changes: Vec<Change> = protections.iter().cloned().map(Change::Protection).collect();
    queries.extend(Changed::all(&queries, &changes));
    for scheme in &queries {
        let errors = with_queries(views, positions, &**scheme, &key)?;
        let row = row(scheme.name(), scheme.changes(), &errors);
        rows.push((Protects::Queries(&**scheme), Localization { of_queries: true, ..row }));
    }
    if let Some(held) = held {
        let limits: Vec<(String, f64, f64)> = match points.unit() {
            Unit::Meter => [(0.05, 5.0), (0.25, 2.0), (0.5, 5.0)]
                .map(|(m, angle)| (format!("{:.0} cm, {angle} deg", 100.0 * m), m, angle))
                .to_vec(),
            // Without a scale, multiples of the unprotected bound.
            _ => rows[0].1.center_error.map_or(Vec::new(), |bound| {
                [10.0, 30.0, 100.0]
                    .map(|times| (format!("{times} times the bound, 5 deg"), times * bound, 5.0))
                    .to_vec()
            }),
        };
        let (n_rows, mut base) = (rows.len(), None);
        for (at, (protects, row)) in rows.iter_mut().enumerate() {
            steps(at, n_rows, &row.scheme);
            let problems = match protects {
                Protects::Nothing => held.unprotected(),
                Protects::Map(scheme) => held.with_map(*scheme, &key)?,
                Protects::Queries(scheme) => held.with_queries(*scheme, &key)?,
            };
            let solve = |at: usize| problems[at].solve(seed.wrapping_add(at as u64));
            let errors = parallel::map(problems.len(), solve);
            // The first row is that of the map itself.
            let of_map = base.as_ref().unwrap_or(&errors);
            row.held_out = Some(HeldOut::of(&problems, [&errors, of_map], &limits));
            base.get_or_insert(errors);
        }
    }
    Ok(rows.into_iter().map(|(_, row)| row).collect())
}
