"""Commands: options and help; one module each, without slow imports."""
