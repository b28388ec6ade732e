"""Parts that reports and studies share: page templates, tables, pictures and the style of figures."""
