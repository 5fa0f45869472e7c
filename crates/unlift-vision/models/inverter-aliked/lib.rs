//! A network that paints pictures from ALIKED descriptors.
#![no_std]

/// The ONNX file.
pub static ONNX: &[u8] = include_bytes!("inverter-aliked.onnx");
