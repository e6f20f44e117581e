"""NC programs as text: lossless reading, syntax tree, numbers and block shapes. Nothing here depends on a control."""
