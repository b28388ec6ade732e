"""The closed loop as one compiled function: thousands of crossings where the offline runner makes a few.

The equations are those of `fivebar_control` and `fivebar_sim`, compiled as they stand (`compiling`); what is written
here is the plant's integration, the order of events in a sample, and what is kept of a run.
"""
