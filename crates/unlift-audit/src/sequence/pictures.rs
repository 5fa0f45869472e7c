//! Pictures of what comes back of a few queries, one per scheme and number of queries.

use unlift::audit::Row;
use unlift_report::inversions::Inversion as Sheet;
use unlift_vision::pictures::Points;

use super::{Attack, Hidden};
use crate::Error;
use crate::Progress;
use crate::images::choice;
use crate::inversion::{Inversion, NEAR_PX, weight};

/// Number of queries with pictures.
const SHOWN: usize = 3;

/// Paints what `row` recovers of a few queries, and adds the pictures to their sheets. Photos that
/// cannot be used are reported once.
pub(super) fn paint(
    inversion: &Inversion,
    (hidden, attack): (&Hidden<'_>, &Attack<'_>),
    row: &Row,
    progress: &dyn Progress,
    sheets: &mut Vec<Sheet>,
) -> Result<(), Error> {
    for query in choice::evenly(hidden.views.len(), Some(SHOWN)) {
        let view = &hidden.views[query];
        let at = sheets.iter().position(|sheet| sheet.name == view.name);
        let at = at.unwrap_or_else(|| {
            let size = view.size.map(|side| side as u32);
            sheets.push(Sheet { name: view.name.clone(), size, ..Sheet::default() });
            sheets.len() - 1
        });
        let places: Vec<[f32; 2]> =
            view.original.reveal().positions().iter().map(|&place| view.in_photo(place)).collect();
        let solved = hidden.solve(attack, query)?;
        let recovered = &solved.recovered;
        let slots = 0..recovered.n_slots();
        let place = |slot| recovered.position(slot).map_or([f32::NAN; 2], |p| view.in_photo(p));
        let found: Vec<[f32; 2]> = slots.clone().map(place).collect();
        let weights: Vec<f32> = slots.map(|slot| weight(recovered, slot, NEAR_PX)).collect();
        let Some(descriptors) = hidden.queries[query].released.descriptors() else { continue };
        let points = Points { places: &found, descriptors, weights: &weights, depths: None };
        let original = (&places[..], &view.descriptors);
        let name = (view.name.as_str(), view.size);
        let added = inversion.add_keypoints(name, original, &points, row, &mut sheets[at]);
        if let Err(error) = added {
            progress.say(&format!("note: not painted: {error}"));
        }
    }
    Ok(())
}
