use crate::features::ColorImage;
use unlift::Error;

/// Checks that two pictures have the same size, with at least `least` pixels per side.
pub(crate) fn check_sizes(a: &ColorImage, b: &ColorImage, least: usize) -> Result<(), Error> {
    let size = |image: &ColorImage| format!("{} x {}", image.width(), image.height());
    if (a.width(), a.height()) != (b.width(), b.height()) {
        let expected = format!("another picture of {} pixels", size(a));
        return Err(Error::new("pictures", expected, format!("one of {}", size(b))));
    }
    if a.width().min(a.height()) < least {
        let expected = format!("pictures of at least {least} x {least} pixels");
        return Err(Error::new("pictures", expected, size(a)));
    }
    Ok(())
}
