//! The pictures of one photo, as the page shows them.

use std::sync::{Mutex, MutexGuard, PoisonError};

use unlift::Error;
use unlift::audit::Row;
use unlift_report::ByAttack;
use unlift_report::inversions::{Inversion as Sheet, Painted};
use unlift_vision::features::photo::jpeg_of;
use unlift_vision::pictures::{Metrics, Picture, Reference};

const SHOWN: usize = 320;

/// Adds a picture by the attack of `row` to the sheet of its photo; `baseline` is that of the true points.
pub fn add_to(
    sheet: &mut Sheet,
    (photo, baseline): (&Reference, &Picture),
    picture: &Picture,
    row: &Row,
) -> Result<(), Error> {
    if sheet.photo.is_empty() {
        sheet.photo = jpeg_of(&photo.image, SHOWN)?;
        sheet.baseline = painted(baseline)?;
    }
    sheet.views.push(ByAttack { row: row.clone(), recovered: painted(picture)? });
    Ok(())
}

fn painted(picture: &Picture) -> Result<Painted, Error> {
    let Metrics { ssim, lpips, .. } = picture.metrics;
    Ok(Painted { jpeg: jpeg_of(&picture.image, SHOWN)?, ssim, lpips })
}

/// Locks what is complete even if another thread panicked.
pub fn lock<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}
