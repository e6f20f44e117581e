"""The certificate of a correction: a second reader, which shares no parsing code with `fix`, judges its output."""
