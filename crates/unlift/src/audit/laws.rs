//! Laws of schemes that an audit checks before it reports a row.

use crate::Error;
use crate::evaluate::{away_from_own, belongs, farthest_for_rounding};
use crate::obfuscate::{Scheme, all, obfuscate};
use crate::released::Released;
use crate::seed::Key;
use crate::truth::{Original, Secret};

/// Checks two laws of schemes for what a scheme made of `original` under `key`: every hidden point
/// lies on its own record, and the same key gives the same map.
///
/// Little can be recovered from a scheme with a bug, so a report would wrongly call it safe. Tests
/// check the built-in schemes; custom schemes are applied a second time here.
///
/// # Errors
/// The first law that does not hold.
pub fn check_laws<const D: usize>(
    scheme: &dyn Scheme<D>,
    original: &Original<D>,
    key: &Key,
    (released, secret): (&Released<D>, &Secret),
) -> Result<(), Error> {
    belongs(original, released, secret)?;
    if all().any(|entry| entry.name == scheme.name()) {
        return Ok(());
    }
    let away = away_from_own(released, original, secret);
    let farthest = away.iter().copied().fold(0.0, f64::max);
    let most = farthest_for_rounding(released, original, secret);
    // Bearings may have decoys, and nothing is recovered from them in any case.
    if farthest > most && !released.obfuscation().is_bearings() {
        let off = away.iter().filter(|&&away| away > most).count();
        let found = format!("{off} of {} away from them, by up to {farthest:.2e}", away.len());
        return Err(Error::new("hidden points", "on their own records", found));
    }
    let (again, secret_again) = obfuscate(scheme, original, None, key)?;
    if again.obfuscation() != released.obfuscation() || secret_again.hidden() != secret.hidden() {
        return Err(Error::new("records", "the same for the same key", "different ones"));
    }
    Ok(())
}
