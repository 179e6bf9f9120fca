"""The hydraulic power unit apart: pump, accumulator, relief valve, filter, tank and compensator for up to four axes."""
