!> MUMPS (sequential) behind one function of a shared library, `lib/libigaform_mumps.so`, which is
!! loaded when it is first needed. Where the program was built without MUMPS there is no such
!! library, and a message says so; nothing else differs.
!!
!! What is in `mumps_call_t` is what `mumps_call.c` reads and writes.
module mumps_library
  use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_procpointer, c_funptr, &
                                         c_int, c_int64_t, c_null_funptr, c_null_ptr, c_ptr
  use failure, only: error_t, fail
  use system_files, only: folder_above, load_library, procedure_in, program_folder
  implicit none
  private

  public :: find_mumps, call_mumps

  integer(c_int), parameter, public :: mumps_analyse = 1, mumps_factorise = 2, mumps_solve = 3, &
                                       mumps_end = 4

  !> As call_t in mumps_call.c.
  type, bind(C), public :: mumps_call_t
    type(c_ptr) :: instance = c_null_ptr       !! between analysis and end
    type(c_ptr) :: rows = c_null_ptr, columns = c_null_ptr
    type(c_ptr) :: values = c_null_ptr
    type(c_ptr) :: right = c_null_ptr          !! right sides in columns, then the solutions
    type(c_ptr) :: folder = c_null_ptr         !! for factors on disk
    integer(c_int64_t) :: n_entries = 0
    integer(c_int) :: n = 0, n_right = 0
    integer(c_int) :: spare = 0                !! percent of memory beyond the estimate
    integer(c_int) :: code = 0, detail = 0     !! INFOG(1) and INFOG(2) of MUMPS
    integer(c_int) :: n_negative = 0, n_null = 0, null_unknown = 0
    integer(c_int) :: megabytes = 0, megabytes_on_disk = 0
    real(c_double) :: n_factor_entries = 0.0_c_double, n_operations = 0.0_c_double
  end type mumps_call_t

  abstract interface
    subroutine mumps_procedure(job, call) bind(C)
      import :: c_int, mumps_call_t
      integer(c_int), value :: job
      type(mumps_call_t), intent(inout) :: call
    end subroutine mumps_procedure
  end interface

contains

  !> Load MUMPS. Fails where the program was built without it, or where it cannot be loaded.
  subroutine find_mumps(entry, error)
    type(c_funptr), intent(out) :: entry               !! for `call_mumps`
    type(error_t), allocatable, intent(out) :: error
    character(*), parameter :: file = "lib/libigaform_mumps.so"
    character(:), allocatable :: folder, why
    type(c_ptr) :: handle
    logical :: has_mpi

    entry = c_null_funptr
    folder = folder_above(file)
    if (folder == "") then
      call fail(error, "the solver of static steps is not available: this program was built "// &
                "without MUMPS (no "//file//" above its folder, "//program_folder()//")")
      return
    end if
    ! The sequential MUMPS brings an MPI of one process, whose names are those of the real one.
    has_mpi = c_associated(procedure_in(c_null_ptr, "MPI_Init"))
    call load_library(folder//"/"//file, handle, why, is_apart=has_mpi)
    if (c_associated(handle)) entry = procedure_in(handle, "igaform_mumps")
    if (.not. c_associated(entry)) &
      call fail(error, "the solver of static steps cannot be loaded: "//why)
  end subroutine find_mumps

  !> Have MUMPS do a job: `mumps_analyse` and so on.
  subroutine call_mumps(entry, job, call)
    type(c_funptr), intent(in) :: entry
    integer(c_int), intent(in) :: job
    type(mumps_call_t), intent(inout) :: call
    procedure(mumps_procedure), pointer :: run

    call c_f_procpointer(entry, run)
    call run(job, call)
  end subroutine call_mumps

end module mumps_library
