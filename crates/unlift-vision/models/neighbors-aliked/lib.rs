//! A network that scores near points by their ALIKED descriptors.
#![no_std]

/// The ONNX file.
pub static ONNX: &[u8] = include_bytes!("neighbors-aliked.onnx");
