!> Provenance and timings in a results file.
module provenance_record
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use timer, only: watch_seconds
  use hdf5_file, only: create_group, hdf5_file_t, integer_values, write_integers, write_reals, &
                       write_text, write_text_attribute
  use provenance, only: compiler_flags, compiler_name, host_cores, provenance_t, text_or_empty, &
                        timestamp
  use run_log, only: ns_per_element_step, timings_t
  implicit none
  private

  public :: write_provenance, write_blank_mass, write_width_ratio, write_timings

contains

  !> Write /provenance; its attribute `status` says running until the file is closed in order.
  subroutine write_provenance(file, source)
    type(hdf5_file_t), intent(inout) :: file
    type(provenance_t), intent(in) :: source
    character(*), parameter :: folder = "/provenance/"
    character(:), allocatable :: flags

    flags = text_or_empty(source%build_flags)
    if (len(flags) == 0) flags = compiler_flags()
    call create_group(file, "/provenance")
    call write_text_attribute(file, "/provenance", "status", "running")
    call write_text_attribute(file, "/provenance", "identity", text_or_empty(source%identity))
    call write_text(file, folder//"version", text_or_empty(source%version), &
                    "version of the program")
    call write_text(file, folder//"git_commit", text_or_empty(source%git_commit), &
                    "commit of the program's sources")
    call write_text(file, folder//"compiler", compiler_name(), "compiler of the program")
    call write_text(file, folder//"compiler_flags", flags, "options of the compiler")
    call write_text(file, folder//"build", text_or_empty(source%build), &
                    "what the bits of results depend on besides the deck, one a line")
    call write_text(file, folder//"command_line", text_or_empty(source%command_line), &
                    "command that made this file")
    call write_text(file, folder//"deck_file", text_or_empty(source%deck_file), "name of the deck")
    call write_text(file, folder//"deck_text", text_or_empty(source%deck_text), &
                    "the deck as it was read")
    call write_text(file, folder//"heading", text_or_empty(source%heading), "heading of the deck")
    call write_text(file, folder//"units", text_or_empty(source%units), "units label of the deck")
    call write_text(file, folder//"start_time", timestamp(), "local time at the start")
    call write_integers(file, folder//"threads", [int(source%n_threads, int64)], [integer ::], &
                        "threads of the run", integer_values)
    call write_integers(file, folder//"host_cores", [int(host_cores(), int64)], [integer ::], &
                        "processors of the machine", integer_values)
  end subroutine write_provenance

  !> Write the mass of the blank beside the provenance.
  subroutine write_blank_mass(file, mass, unit)
    type(hdf5_file_t), intent(inout) :: file
    real(wp), intent(in) :: mass
    character(*), intent(in) :: unit

    call write_reals(file, "/provenance/blank_mass", [mass], [integer ::], unit, &
                     "mass of the blank without what scaling has added")
  end subroutine write_blank_mass

  !> Write that the blank of the file stands for a wider one.
  subroutine write_width_ratio(file, ratio)
    type(hdf5_file_t), intent(inout) :: file
    real(wp), intent(in) :: ratio

    call write_reals(file, "/provenance/width_ratio", [ratio], [integer ::], "1", &
                     "full width, of which forces, energies and masses are, over that of the blank")
  end subroutine write_width_ratio

  !> Write /timings: one group for each effect, and the cost of the whole run.
  subroutine write_timings(file, timings)
    type(hdf5_file_t), intent(inout) :: file
    type(timings_t), intent(in) :: timings
    character(:), allocatable :: folder
    integer :: i

    call create_group(file, "/timings/effects")
    do i = 1, size(timings%timer%watches)
      associate (watch => timings%timer%watches(i))
        folder = "/timings/effects/"//watch%name
        call write_reals(file, folder//"/seconds", [watch_seconds(timings%timer, i)], &
                         [integer ::], "s", "wall-clock time of this effect")
        call write_integers(file, folder//"/calls", [watch%n_calls], [integer ::], &
                            "number of calls", integer_values)
      end associate
    end do
    call write_reals(file, "/timings/wall_seconds", [timings%wall_seconds], [integer ::], "s", &
                     "wall-clock time of all steps")
    call write_integers(file, "/timings/steps", [timings%n_steps], [integer ::], &
                        "number of steps", integer_values)
    call write_integers(file, "/timings/elements", [int(timings%n_elements, int64)], &
                        [integer ::], "number of elements", integer_values)
    call write_reals(file, "/timings/ns_per_element_step", [ns_per_element_step(timings)], &
                     [integer ::], "ns", "wall-clock time per element and step")
  end subroutine write_timings

end module provenance_record
