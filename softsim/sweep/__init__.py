"""Studies run: cases on the processors of one machine or many, their table, their optimum."""
