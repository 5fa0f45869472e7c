//! Selection of the network that paints.

use std::path::Path;

use unlift::Descriptors;
use unlift_audit::inversion::Painter;
use unlift_vision::network::DescriptorKind;
use unlift_vision::pictures::Inverter;

use crate::exit::usage;

/// Returns the kind of `descriptors`; an error about `option` if there are none.
pub fn kind(option: &str, descriptors: Option<&Descriptors>) -> anyhow::Result<DescriptorKind> {
    let Some(descriptors) = descriptors else {
        return Err(usage(format!("{option}: expected descriptors, found none")));
    };
    DescriptorKind::of(descriptors, option).map_err(|error| usage(error.to_string()))
}

/// Opens the painter for descriptors of `kind`: the network in the file `own`, or the known one.
pub fn painter(kind: DescriptorKind, own: Option<&Path>) -> anyhow::Result<Painter> {
    let inverter = match own {
        Some(path) => Inverter::read(path, kind),
        None => Inverter::of(kind),
    };
    Ok(Painter::try_new(inverter?)?)
}
