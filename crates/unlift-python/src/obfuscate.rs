//! Hiding of maps under schemes of unlift or of the user.

use std::sync::Arc;

use pyo3::prelude::*;
use unlift::audit::check_laws;
use unlift::obfuscate::{Scheme, SchemeOptions, obfuscate as hide, scheme};
use unlift::seed::Key;

use crate::errors::{raised, wrong};
use crate::hidden::{Hidden, Released, Truth};
use crate::map::Map;
use crate::own::{OwnScheme, Raised};
use crate::work;

/// Returns the scheme for `given`, a name or a function.
pub fn scheme_of<const D: usize>(
    given: &Bound<'_, PyAny>,
    options: &SchemeOptions,
    raised_by: &Raised,
) -> PyResult<Arc<dyn Scheme<D>>>
where
    OwnScheme: Scheme<D>,
{
    let Ok(name) = given.extract::<String>() else {
        return Ok(Arc::new(OwnScheme::new(given, raised_by)?));
    };
    let entry = scheme(&name).map_err(raised)?;
    let subjects = if D == 2 { "images" } else { "maps" };
    let expected = format!("one that is defined on {subjects}");
    entry.of_dimension::<D>(options).ok_or_else(|| wrong("scheme", expected, name))
}

/// Hides a map under a scheme, a name or a function. Without a seed it uses a fresh key, for maps
/// that are released. Never release a map made with a seed: whoever guesses the seed can restore
/// the order of the records and, under `cp`, the points.
#[pyfunction]
#[pyo3(signature = (map, scheme, *, seed=None))]
pub fn obfuscate(
    py: Python<'_>,
    map: &Map,
    scheme: &Bound<'_, PyAny>,
    seed: Option<u64>,
) -> PyResult<Hidden> {
    let by = Raised::default();
    let unit = map.prepared.original.reveal().unit();
    let scheme = scheme_of::<3>(scheme, &SchemeOptions::usual(unit), &by)?;
    let key = seed.map_or_else(Key::fresh, |seed| Ok(Key::from_seed(seed))).map_err(raised)?;
    let prepared = Arc::clone(&map.prepared);
    let hidden = work::run(py, None, Some(by.stop()), move || {
        let (original, descriptors) = (&prepared.original, prepared.descriptors.as_ref());
        let (released, secret) = hide(&*scheme, original, descriptors, &key)?;
        check_laws(&*scheme, original, &key, (&released, &secret))
            .map_err(|error| error.within(scheme.name()))?;
        Ok::<_, unlift::Error>((released, secret))
    });
    let (released, secret) = hidden.map_err(|error| by.as_cause_of(py, error))?;
    let truth = Truth::of(Arc::clone(&map.prepared), secret);
    Ok(Hidden::of(Released::from(released), truth))
}
