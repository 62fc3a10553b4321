!> What users' subroutines are told before the first increment: the name of the job, and that the
!! analysis starts, which is when they read their files and fill their COMMON blocks.
module user_start
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_double, c_f_procpointer, c_int, &
                                         c_null_funptr, c_null_ptr
  use child_process, only: c_text
  use umat_interface, only: uexternaldb_procedure, vexternaldb_procedure
  use user_library, only: user_library_t
  use user_call, only: enter_user_call, leave_user_call, watch_user_calls, in_uexternaldb, &
                       in_vexternaldb
  implicit none
  private

  public :: start_user_code

  interface
    subroutine set_job(name, name_length, place, place_length) bind(C, name="igaform_set_job")
      import :: c_char, c_int
      integer(c_int), value :: name_length, place_length
      character(kind=c_char), intent(in) :: name(*), place(*)
    end subroutine set_job
  end interface

contains

  !> Tell the name of the job and the folder of its results, then call UEXTERNALDB and VEXTERNALDB
  !! where there are such, with LOP = 0.
  subroutine start_user_code(library, job, folder)
    type(user_library_t), intent(in) :: library
    character(*), intent(in) :: job, folder
    procedure(uexternaldb_procedure), pointer :: uexternaldb
    procedure(vexternaldb_procedure), pointer :: vexternaldb
    real(c_double) :: times(10)
    integer(c_int) :: numbers(10)

    call set_job(c_text(job), int(len(job), c_int), c_text(folder), int(len(folder), c_int))
    call watch_user_calls(c_null_funptr, c_null_ptr)
    times = 0.0_c_double
    numbers = 0_c_int
    if (c_associated(library%uexternaldb)) then
      call c_f_procpointer(library%uexternaldb, uexternaldb)
      call enter_user_call(in_uexternaldb, -1_c_int, -1_c_int, -1_c_int)
      call uexternaldb(0_c_int, 0_c_int, times(:2), times(1), 1_c_int, 0_c_int)
    end if
    if (c_associated(library%vexternaldb)) then
      call c_f_procpointer(library%vexternaldb, vexternaldb)
      numbers(3) = 1_c_int   ! the step
      call enter_user_call(in_vexternaldb, -1_c_int, -1_c_int, -1_c_int)
      call vexternaldb(0_c_int, numbers, int(size(numbers), c_int), times, &
                       int(size(times), c_int))
    end if
    call leave_user_call()
  end subroutine start_user_code

end module user_start
