//! A value of an image or of a map.

/// A value of an image (2D) or of a map (3D).
#[derive(Clone, Debug)]
pub enum Either<I, M> {
    Image(I),
    Map(M),
}

/// Evaluates `$made` with `$one` as the content of `$either`.
macro_rules! of_either {
    ($either:expr, $one:ident => $made:expr) => {
        match $either {
            $crate::either::Either::Image($one) => $made,
            $crate::either::Either::Map($one) => $made,
        }
    };
}

pub(crate) use of_either;
