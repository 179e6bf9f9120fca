"""Files of measurements, one format a module, read into one plain value; and readings that a sensor got wrong."""
