//! Joint recovery of one map by many, none of whom has all lists.
//!
//! Each has the edges of some slots (`part`) and all records. One, who has neither, has what is small: a place and some
//! numbers per slot, and a sample of the edges (`lead`). In every round the lead says where it stands, each part where its slots go, the
//! lead who jumped, and each part whom that concerns. The same as at once, bit for bit.
//! Between two rounds a lead is bytes that another goes on from (`kept`).

mod kept;
pub(super) mod lead;
mod part;
