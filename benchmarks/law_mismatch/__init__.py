"""Discovery judged on specimens whose law is not the base: generated here without any of mrfit's own formulas."""
