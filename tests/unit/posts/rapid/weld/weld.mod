MODULE weld
  PERS tooldata RmpTool:=[TRUE,[[0,0,0],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];
  PERS wobjdata RmpFrame:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  VAR pos mid;
  VAR bool RmpTimeout2;

  PROC main()
    ConfJ\Off;
    ConfL\Off;
    mid:=[0,0,0];
    mid:=[680,-90,100];
    MoveJ RmpTarget([[500,-150,180],[0.382683432,0,0.923879533,0]]),[5000,500,5000,1000],fine,RmpTool\WObj:=RmpFrame;
    MoveL RmpTarget([[500,-150,100],[0.382683432,0,0.923879533,0]]),[300,90,5000,1000],fine,RmpTool\WObj:=RmpFrame;
    SetDO do5,1;
    WaitUntil DInput(di6)=1\MaxTime:=2\TimeFlag:=RmpTimeout2;
    MoveL RmpTarget([[620,-150,100],[0.382683432,0,0.923879533,0]]),[8,90,5000,1000],[FALSE,1,1.5,1.5,0.15,1.5,0.15],RmpTool\WObj:=RmpFrame;
    MoveC RmpTarget([mid,[0.382683432,0,0.923879533,0]]),RmpTarget([[620,-30,100],[0.382683432,0,0.923879533,0]]),[8,90,5000,1000],[FALSE,1,1.5,1.5,0.15,1.5,0.15],RmpTool\WObj:=RmpFrame;
    MoveL RmpTarget([[500,-30,100],[0.382683432,0,0.923879533,0]]),[8,90,5000,1000],fine,RmpTool\WObj:=RmpFrame;
    SetDO do5,0;
    WaitTime 0.5;
    MoveL RmpTarget([[500,-30,180],[0.382683432,0,0.923879533,0]]),[300,90,5000,1000],fine,RmpTool\WObj:=RmpFrame;
  ENDPROC

  LOCAL FUNC robtarget RmpTarget(pose p)
    VAR robtarget t;
    t:=CRobT(\Tool:=RmpTool\WObj:=RmpFrame);
    t.trans:=p.trans;
    t.rot:=p.rot;
    RETURN t;
  ENDFUNC
ENDMODULE
