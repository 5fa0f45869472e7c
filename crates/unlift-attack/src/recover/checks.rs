//! Whether lists and records go together, and can be solved as it is asked.

use crate::Error;
use crate::neighbors::Neighborhoods;
use crate::released::{Obfuscation, Released};

/// Refuses rays that are compared with all others of their anchor, which takes all lists.
pub(super) fn check_anchors<const D: usize>(released: &Released<D>) -> Result<(), Error> {
    match released.obfuscation() {
        Obfuscation::Rays(rays) if rays.regions().is_some() => {
            Err(Error::new("records of parts", "such as say nothing about others", "anchors"))
        }
        _ => Ok(()),
    }
}

/// Refuses lists that are not of this map.
pub(super) fn check_lists<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
) -> Result<(), Error> {
    if lists.n_slots() != released.n_slots() {
        let expected = format!("{} rows, one per slot", released.n_slots());
        return Err(Error::new("neighborhoods", expected, lists.n_slots().to_string()));
    }
    // Lists of another map may have as many rows.
    let n_records = released.n_records();
    if let Some(record) = lists.records().iter().find(|record| record.index() >= n_records) {
        let expected = format!("records below {n_records}");
        return Err(Error::new("neighborhoods", expected, record.0.to_string()));
    }
    Ok(())
}
