//! What is of an image or of a map: the same in two dimensions and in three.

/// Of an image, or of a map.
#[derive(Clone, Debug)]
pub enum Either<I, M> {
    Image(I),
    Map(M),
}

/// `$made` of `$one`, which is what `$either` holds.
macro_rules! of_either {
    ($either:expr, $one:ident => $made:expr) => {
        match $either {
            $crate::either::Either::Image($one) => $made,
            $crate::either::Either::Map($one) => $made,
        }
    };
}

pub(crate) use of_either;
