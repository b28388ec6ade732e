"""What all reports and studies share: the page, its tables and pictures, the style of figures."""
